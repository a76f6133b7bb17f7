"""The arm itself: segments, rotations, kinematics, angles, ranges. Only numpy; knows no network."""
