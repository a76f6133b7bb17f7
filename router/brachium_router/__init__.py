"""The Zenoh router of a room, in a Python process."""
