"""How a node takes its leave, so that what was lost at the end is counted too. Loaded when it must."""

import asyncio

_WITHIN_S = 2


async def say_bye(link, batches, clock):
    """Send what is left and the number of the next sample, and wait until the gateway has heard it."""
    batches.close()
    try:
        batch = batches.next()
        while batch is not None:
            await asyncio.wait_for(link.send(batches.fill, batch), _WITHIN_S)
            batches.sent(batch)
            batch = batches.next()
        await asyncio.wait_for(link.send(_bye, clock.number), _WITHIN_S)
        while True:
            await asyncio.wait_for(link.receive(), _WITHIN_S)
    except (OSError, EOFError, asyncio.TimeoutError):
        pass
    print("sent %d, dropped %d, next %d" % (batches.delivered, batches.dropped, clock.number))


def _bye(writer, following):
    writer.begin(1, "bye/1")
    writer.whole("next", following)
