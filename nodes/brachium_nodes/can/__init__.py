"""CAN both ways: inertial sensors on a CAN bus come in, joint angles for a machine go out."""
