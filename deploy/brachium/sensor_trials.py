"""Emulated chips calibrated by hands that do what they are told, as fast as it goes, and what is left."""

from dataclasses import dataclass

import numpy as np

from brachium_body import rotation
from brachium_body.segments import Segment
from brachium_fusion import magnetometer_calibration as magnetometer
from brachium_fusion import sensor_calibration as fits
from brachium_fusion.calibrated import Calibrated
from brachium_fusion.sensor_guide import ALL, SensorGuide
from brachium_nodes.bench_hands import Hands, Mistake
from brachium_nodes.calibration_bench import CalibrationBench
from brachium_nodes.emulate_bench import bench_packets
from brachium_nodes.sensors import FIELD_UT, Chip
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_wire.messages import Info, SensorCalibration
from brachium_wire.samples import Samples

SEGMENT: Segment = "forearm_r"
RATE_HZ = 100.0
DIRECTIONS = 500


@dataclass(frozen=True, kw_only=True)
class Residuals:
    """What a calibration leaves of a chip's errors, at worst of its axes, or of all directions."""

    gyro_bias_dps: float
    accel_bias_m_s2: float
    accel_scale: float
    mag_direction_deg: float
    """Angle between the field and what the calibrated magnetometer shows, without its noise."""


def settings_of(seed: int) -> WearerSettings:
    """Return the chip that this seed puts on the forearm, worn by nobody yet."""
    return WearerSettings(level="typical", seed=seed, rate_hz=RATE_HZ, batch=10, segments=(SEGMENT,))


def guided(seed: int, mistake: Mistake = "") -> SensorGuide:
    """Return the guide of a whole calibration that has come to its end."""
    info = Info(node="n", rate_hz=RATE_HZ, origin="emulated", host="here", magnetometer=True)
    guide = SensorGuide(SEGMENT, info, list(ALL))
    hands = Hands(seed, SEGMENT, mistake)
    for packet in bench_packets(Wearer(settings_of(seed)), SEGMENT, hands, lambda: guide.progress().step):
        batch = packet.batch
        acc, gyr, mag = (
            np.frombuffer(block or b"", "<f4").reshape(-1, 3).astype(np.float64)
            for block in (batch.acc, batch.gyr, batch.mag)
        )
        times = [round(1e9 * t) for t in packet.times_s.tolist()]
        guide.take(
            Samples(
                sequence=batch.sequence, time_ns=times, device_us=batch.device_us, device_offsets=b"",
                received_ns=times[-1], uncertainty_ns=0, acc=acc, gyr=gyr, mag=mag, mag_index=None, quat=None,
                late=False,
            )
        )  # fmt: skip
        if guide.over:
            break
    return guide


def as_in_the_paper(seed: int) -> SensorCalibration:
    """Return what the paper's procedure finds (Tsilomitrou et al. 2021, 4.1) of the same chip on a bench."""
    bench = CalibrationBench(settings_of(seed), SEGMENT)
    rest, faces, turned = bench.at_rest(), bench.six_faces(), bench.turned_everywhere(30.0)
    gyro = fits.gyro_at_rest(rest.gyr, rest.acc, RATE_HZ).calibration
    accel = fits.accel_six_faces(np.stack([face.acc.mean(axis=0) for face in faces.values()])).calibration
    mag = magnetometer.mag_min_max(turned.mag).calibration
    return SensorCalibration(
        gyro_bias=gyro.gyro_bias,
        accel_scale=accel.accel_scale,
        accel_bias=accel.accel_bias,
        mag_offset=mag.mag_offset,
    )


def residuals(seed: int, found: SensorCalibration) -> Residuals:
    """Return what `found` leaves of the errors that were put into the chip."""
    bench = CalibrationBench(settings_of(seed), SEGMENT)
    true = bench.perfect_calibration()
    return Residuals(
        gyro_bias_dps=float(np.degrees(_worst(found.gyro_bias, true.gyro_bias, 0.0))),
        accel_bias_m_s2=_worst(found.accel_bias, true.accel_bias, 0.0),
        accel_scale=_worst(found.accel_scale, true.accel_scale, 1.0),
        mag_direction_deg=_direction_deg(found, bench.chip),
    )


def _worst(found: object, true: object, nothing: float) -> float:
    of = np.full(3, nothing) if found is None else np.array(found, dtype=np.float64)
    return float(np.abs(of - np.array(true, dtype=np.float64)).max())


def _direction_deg(found: SensorCalibration, chip: Chip) -> float:
    """Return the largest angle over sensors turned every way."""
    c = chip.calibration
    turns = rotation.normalize(np.random.default_rng(0).normal(size=(DIRECTIONS, 4)))
    true = rotation.rotate(turns, FIELD_UT)
    raw = (true + chip.mag_bias) @ np.linalg.inv(np.array(c.mag_matrix)).T + np.array(c.mag_offset)
    seen = Calibrated(found).mag(raw)
    cosines = np.einsum("ij,ij->i", seen, true) / np.linalg.norm(seen, axis=1) / np.linalg.norm(true, axis=1)
    return float(np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))).max())
