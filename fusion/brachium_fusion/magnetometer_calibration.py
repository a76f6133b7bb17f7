"""Fits of a magnetometer's hard and soft iron, from readings as the chip gives them. Pure.

The paper's (Tsilomitrou et al. 2021, 4.1) is `mag_min_max`; `mag_ellipsoid` finds more.
"""

import numpy as np
from scipy.optimize import least_squares

from brachium_fusion.sensor_calibration import OUTWARD, Floats, Refused, SensorFit, check_covered
from brachium_wire.messages import SensorCalibration
from brachium_wire.tuples import vector

MAG_RESIDUAL = 0.06
"""Part of the field, a robust SD: more means that iron or a magnet was near for much of the turning."""
MOST_STEPS = 50
"""Of the fit: a sound one takes about ten, one beside iron would take thousands and find nothing."""
FIELD_LEAST, FIELD_MOST = 15.0, 90.0
"""uT: the Earth's field has 22 to 67, and a magnetometer's scale may be a quarter off."""
END_LEAST, END_SHARE = 200.0, 0.05
"""uT, share of the readings: far from any field but a magnet's, so many alike are the end of its scale."""
MAG_ROWS = 100


def mag_min_max(mag: Floats) -> SensorFit:
    """Return the magnetometer's offset as the paper has it: per axis the middle of least and greatest.

    `mag` (n, 3) uT while the sensor is turned in many directions.
    """
    low, high = mag.min(axis=0), mag.max(axis=0)
    offset, reach = (low + high) / 2.0, (high - low) / 2.0
    if len(mag) < MAG_ROWS or reach.min() < OUTWARD * reach.max():
        raise Refused("the sensor was not turned through all directions: turn it slowly about every axis")
    return SensorFit(
        method="mag-min-max",
        calibration=SensorCalibration(mag_offset=vector(offset)),
        scores=_mag_scores(mag - offset),
    )


def mag_ellipsoid(mag: Floats) -> SensorFit:
    """Return hard iron (offset) and soft iron (symmetric matrix) of readings (n, 3) uT all around.

    The readings lie on an ellipsoid; the matrix of determinant 1 makes it a sphere. First the general
    quadric with least squares of its ten coefficients, then |matrix (m - offset)| = field, robust to a
    passing magnet. A turn between magnetometer and accelerometer is not found by this.
    """
    if len(mag) < MAG_ROWS:
        raise Refused(f"{len(mag)} readings, {MAG_ROWS} are needed: turn the sensor for half a minute")
    _check_range(mag)
    offset, matrix = _quadric(mag)
    centred = (mag - offset) @ matrix
    check_covered(
        centred / np.linalg.norm(centred, axis=1, keepdims=True), "turn the sensor slowly about every axis"
    )
    field = float(np.median(np.linalg.norm(centred, axis=1)))
    upper = np.triu_indices(3)

    def residual(p: Floats) -> Floats:
        w = np.zeros((3, 3))
        w[upper] = p[3:]
        w = w + np.triu(w, 1).T
        lengths: Floats = np.linalg.norm((mag - p[:3]) @ w, axis=1) - 1.0
        return lengths

    found = least_squares(
        residual,
        np.r_[offset, (matrix / field)[upper]],
        loss="soft_l1",
        f_scale=0.02,
        x_scale="jac",
        max_nfev=MOST_STEPS,
    )
    offset = found.x[:3]
    whole = np.zeros((3, 3))
    whole[upper] = found.x[3:]
    whole = whole + np.triu(whole, 1).T
    matrix = whole / np.cbrt(np.linalg.det(whole))
    scores = _mag_scores((mag - offset) @ matrix)
    if scores["residual_part"] > MAG_RESIDUAL:
        raise Refused(
            f"the field varies by {100 * scores['residual_part']:.0f} % after the fit "
            f"({100 * MAG_RESIDUAL:.0f} % at most): turn the sensor away from iron, cables and speakers"
        )
    if not FIELD_LEAST <= scores["field_ut"] <= FIELD_MOST:
        raise Refused(
            f"the readings fit a field of {scores['field_ut']:.0f} uT, the Earth's has 22 to 67: "
            "iron or a magnet is near; go to another place"
        )
    return SensorFit(
        method="mag-ellipsoid",
        calibration=SensorCalibration(
            mag_offset=vector(offset),
            mag_matrix=(vector(matrix[0]), vector(matrix[1]), vector(matrix[2])),
        ),
        scores=scores,
    )


def _check_range(mag: Floats) -> None:
    """Raise Refused when an axis rests at its end: what lies beyond is not known."""
    for axis, name in enumerate("xyz"):
        for end in (mag[:, axis].min(), mag[:, axis].max()):
            if abs(end) > END_LEAST and np.mean(mag[:, axis] == end) > END_SHARE:
                raise Refused(
                    f"the magnetometer's {name} stops at {end:.0f} uT, its end: take away the magnet, or the "
                    "magnetised part of the case"
                )


def _quadric(m: Floats) -> tuple[Floats, Floats]:
    """Return the centre and the symmetric matrix of determinant 1 of the ellipsoid through m (n, 3)."""
    middle, size = m.mean(axis=0), float(m.std())
    x, y, z = ((m - middle) / size).T
    design = np.column_stack(
        [x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z, 2 * x, 2 * y, 2 * z, np.ones_like(x)]
    )
    a = np.linalg.svd(design, full_matrices=False)[2][-1]
    shape = np.array([[a[0], a[3], a[4]], [a[3], a[1], a[5]], [a[4], a[5], a[2]]])
    shape = shape * (np.sign(np.trace(shape)) or 1.0)
    linear = a[6:9] * (np.sign(a[0] + a[1] + a[2]) or 1.0)
    values, vectors = np.linalg.eigh(shape)
    if values[0] <= 1e-3 * values[-1]:
        raise Refused("the readings lie on no ellipsoid: turn the sensor slowly about every axis")
    centre = -np.linalg.solve(shape, linear)
    root = vectors @ np.diag(np.sqrt(values)) @ vectors.T
    return centre * size + middle, root / np.cbrt(np.linalg.det(root))


def _mag_scores(centred: Floats) -> dict[str, float]:
    """Return the field and, as parts of it, how far readings are off: nine of ten as an SD, and all."""
    lengths = np.linalg.norm(centred, axis=1)
    field = float(np.median(lengths))
    off = np.abs(lengths - field) / field
    return {
        "field_ut": field,
        "residual_part": float(np.percentile(off, 90.0) / 1.645),
        "residual_rms_part": float(np.sqrt(np.mean(off**2))),
    }
