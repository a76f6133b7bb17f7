"""Numbers that trackers say of themselves: where on the body they are worn, and which sensor they carry."""

from brachium_body.segments import Segment

SEGMENT_AT: dict[int, Segment] = {
    3: "sternum",
    4: "sternum",
    13: "forearm_l",
    14: "forearm_r",
    15: "upper_arm_l",
    16: "upper_arm_r",
    17: "hand_l",
    18: "hand_r",
}
"""By position: upper chest, chest, then lower arm, upper arm and hand, left before right."""

CHIPS = {
    1: "MPU-9250",
    2: "MPU-6500",
    3: "BNO080",
    4: "BNO085",
    5: "BNO055",
    6: "MPU-6050",
    7: "BNO086",
    8: "BMI160",
    9: "ICM-20948",
    10: "ICM-42688",
    11: "BMI270",
    12: "LSM6DS3TR-C",
    13: "LSM6DSV",
    14: "LSM6DSO",
    15: "LSM6DSR",
    16: "ICM-45686",
    17: "ICM-45605",
}


def chip(imu: int | None) -> str:
    """Return the name of a sensor type."""
    return CHIPS.get(imu or 0, "SlimeVR")
