"""Time alignment, calibration, orientation and joints: a pure core and one thin service."""
