"""The arm itself: segments, rotations, kinematics, angle conventions, ranges. Only numpy; knows no network."""
