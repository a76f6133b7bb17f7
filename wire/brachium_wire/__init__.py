"""The contract: keys, messages, bytes, the session on the bus, and the same messages at rest."""
