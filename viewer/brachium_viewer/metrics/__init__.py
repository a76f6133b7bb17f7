"""Measures of a movement, from numbers alone: no socket, clock, file or page."""
