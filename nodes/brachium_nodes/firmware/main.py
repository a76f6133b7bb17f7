"""What a chip starts by itself when it is switched on; the only file that it needs as text."""

import wearable

wearable.start()
