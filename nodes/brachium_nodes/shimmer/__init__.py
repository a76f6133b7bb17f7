"""Shimmer3 sensors (LogAndStream firmware) over their serial port as nodes."""
