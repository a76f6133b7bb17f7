"""A whole recording at once: captures and recordings of an emulated wearer, against the truth."""

from itertools import takewhile

import numpy as np
import pytest

from brachium_body import rotation
from brachium_fusion import best
from brachium_fusion.best_material import Material, TimedSpan
from brachium_fusion.settings import Settings
from brachium_fusion.solve import SolveError, SolveSettings, run
from brachium_fusion.uniform import Series
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_wire import capture as captures
from brachium_wire import keys, table
from brachium_wire.capture_settings import CaptureSettings, read_settings
from brachium_wire.codec import encode
from brachium_wire.messages import Info, Session
from brachium_wire.recording import RecordingWriter
from brachium_wire.samples import write_samples

RATE = 50.0


def made_session(
    exercise="shrugging", routine="", segments=("upper_arm_r", "forearm_r"), seconds=22.0, **more
):
    settings = WearerSettings(
        exercise=exercise, routine=routine, level="ideal", seed=7, rate_hz=RATE, segments=segments, **more
    )
    return session_arrays(settings, seconds)


def material_of(session, *, magnetometer=True, keep=None) -> Material:
    """Return the session's readings, calibrated by its pose and what was led through."""
    series, infos = {}, {}
    for name, sensor in session.sensors.items():
        rows = slice(None) if keep is None else keep
        series[name] = Series(
            time_s=session.time_s[rows],
            rate_hz=RATE,
            gyr=sensor.gyr[rows],
            acc=sensor.acc[rows],
            mag=sensor.mag[rows] if magnetometer else None,
        )
        mounting = tuple(sensor.nominal_mounting.tolist())
        infos[name] = Info(
            node=name, rate_hz=RATE, origin="emulated", host="h", mounting=mounting, magnetometer=magnetometer
        )
    led = [span for span in session.spans if span.kind in ("elbow-flexion", "pronation", "free")]
    lengths = session.lengths
    return Material(
        series=series,
        infos=infos,
        sequences={name: np.arange(len(one.time_s)) for name, one in series.items()},
        session=Session(
            facing_deg=0.0 if magnetometer else None,
            lengths_m={
                "chest_to_shoulder": lengths.chest_to_shoulder,
                "upper_arm": lengths.upper_arm,
                "forearm": lengths.forearm,
                "hand": lengths.hand,
            },
        ),
        spans=(
            TimedSpan(kind="n-pose", from_s=0.5, to_s=3.5),
            *(TimedSpan(kind=span.kind, from_s=span.from_s, to_s=span.to_s) for span in led),
        ),
        zero_ns=10**15,
    )


def solved(session, **more):
    return best.solve(material_of(session, **more), Settings(), session.time_s)


def column(found, read) -> np.ndarray:
    return np.array([read(skeleton) for skeleton in found.skeletons], dtype=np.float64)


def rms(error) -> float:
    return float(np.sqrt(np.nanmean(np.sum(np.square(error), axis=-1))))


def test_a_shrug_is_followed_to_some_millimetres_with_a_stated_uncertainty() -> None:
    session = made_session()
    found = solved(session)
    shift = column(found, lambda s: s.shoulder_shift or (np.nan,) * 3)
    truth = session.arms["right"].shoulder_shift
    later = session.time_s > 5.0
    assert rms(truth[later]) > 0.02
    assert rms((shift - truth)[later]) < 0.006
    sd = column(found, lambda s: s.shoulder_shift_sd or (np.nan,) * 3)
    assert np.nanmin(sd) > 0.0
    assert np.nanmax(sd[later]) < 0.05
    assert found.parts["shoulder_r"]
    assert any("sternum" in warning for warning in found.warnings)


def test_led_movement_without_a_magnetometer_gives_elbow_and_carrying_angle() -> None:
    session = made_session("reaching", "calibration", seconds=52.0, carrying_deg=10.0)
    found = solved(session, magnetometer=False)
    angles = session.arms["right"].angles
    flexion = column(found, lambda s: s.angles.get("elbow_flexion", np.nan))
    later = session.time_s > 43.0
    error = np.degrees(flexion - angles["elbow_flexion"])[later]
    assert np.sqrt(np.mean(error**2)) < 1.0
    assert found.alignment is not None
    assert np.degrees(found.alignment.joints["elbow_r"].carrying_rad) == pytest.approx(-10.0, abs=1.5)
    assert "elbow_r" in found.parts


def test_a_long_gap_is_missing_and_what_is_beside_it_is_not_touched() -> None:
    session = made_session(seconds=16.0)
    keep = np.ones(len(session.time_s), dtype=bool)
    keep[500:540] = False
    found = solved(session, keep=keep)
    at = {round((s.time_ns - 10**15) * 1e-9 * RATE): s for s in found.skeletons}
    assert not set(range(502, 538)) & set(at)  # both sensors are away: no instant
    assert {490, 545} <= set(at)
    assert all(np.isfinite(list(s.angles.values())).all() for s in found.skeletons)


def test_without_pose_or_magnetometer_it_says_what_could_not_be_had() -> None:
    session = made_session(seconds=6.0)
    material = material_of(session)
    nobody_said = Material(
        series=material.series,
        infos=material.infos,
        sequences=material.sequences,
        session=material.session,
        zero_ns=10**15,
    )
    found = best.solve(nobody_said, Settings(), session.time_s)
    assert found.alignment is None
    assert "alignment" in found.refused
    assert {p.quality for s in found.skeletons for p in s.segments.values()} == {"uncalibrated"}
    assert all(s.shoulder_shift is None for s in found.skeletons)


def test_a_capture_folder_is_solved_at_its_best_and_says_with_what(tmp_path) -> None:
    session = made_session("reaching", seconds=14.0)
    segments = {
        name: captures.CaptureSegment(
            t=session.time_s, rate_hz=RATE, acc=sensor.acc, gyr=sensor.gyr, mag=sensor.mag
        )
        for name, sensor in session.sensors.items()
    }
    (tmp_path / "capture.toml").write_text(
        'facing_deg = 0\n[calibration]\npose = "n-pose"\nfrom_s = 0.5\nto_s = 3.5\n'
    )
    settings: CaptureSettings = read_settings(tmp_path / "capture.toml")
    captures.write(tmp_path / "c", settings, segments)  # type: ignore[arg-type]
    out = tmp_path / "best.csv"
    report = run(SolveSettings(input=tmp_path / "c", out=out, mode="best"))
    assert report.mode == "best"
    assert {"orientation", "alignment"} <= report.parts.keys()
    assert '# mode: "best"' in out.read_text().splitlines()
    columns = table.read(out).columns
    assert columns["time"] == pytest.approx(session.time_s)
    quats = np.stack([columns[f"forearm_r_sensor_q{p}"] for p in "wxyz"], axis=1)
    error = rotation.angle_between(quats, session.sensors["forearm_r"].world_from_sensor)
    assert np.degrees(np.sqrt(np.mean(error**2))) < 4.0
    with pytest.raises(SolveError, match="--mode best has a way of its own"):
        run(SolveSettings(input=tmp_path / "c", mode="best", filter="vqf"))
    with pytest.raises(SolveError, match="--mode 'worst' is not known"):
        run(SolveSettings(input=tmp_path / "c", mode="worst"))  # type: ignore[arg-type]


def test_a_recording_is_solved_at_its_best_on_the_grid_of_its_skeletons(tmp_path, made) -> None:
    wearer = Wearer(WearerSettings(level="ideal", exercise="elbow-flexion", seed=3))
    writer = RecordingWriter(tmp_path / "a.mcap")
    for segment in wearer.segments:
        known = wearer.info(segment)
        info = Info(
            node=f"n-{segment}",
            rate_hz=known.rate_hz,
            origin="emulated",
            host="gw",
            mounting=known.mounting,
            calibration=known.calibration,
            magnetometer=True,
        )
        writer.write(keys.info("room", "p01", segment), encode(info), made.START)
    for packet in takewhile(lambda p: p.send_time_s < 12.0, wearer.all_packets()):
        readings = packet.readings
        batch = write_samples(
            sequence=packet.sequence,
            time_ns=made.START + np.round(1e9 * readings.time_s).astype(np.int64),
            device_us=packet.device_us,
            received_ns=made.START + round(1e9 * packet.send_time_s),
            uncertainty_ns=0,
            acc=readings.acc,
            gyr=readings.gyr,
            mag=readings.mag,
        )
        writer.write(keys.imu("room", "p01", packet.segment), encode(batch), batch.received_ns)
    writer.close()
    live = run(SolveSettings(input=tmp_path / "a.mcap"))
    found = run(SolveSettings(input=tmp_path / "a.mcap", mode="best"))
    assert found.scores
    assert found.rows == pytest.approx(live.rows, abs=3)
    times = {s.time_ns for s in live.skeletons}
    assert len(times & {s.time_ns for s in found.skeletons}) > 0.98 * len(times)
    assert all(s.time_ns % 20_000_000 == 0 for s in found.skeletons)
    elbow = {s.time_ns: s.angles["elbow_flexion"] for s in live.skeletons}
    apart = [
        s.angles["elbow_flexion"] - elbow[s.time_ns]
        for s in found.skeletons
        if s.time_ns in elbow and s.time_ns > made.START + 4 * 10**9
    ]
    assert np.degrees(np.sqrt(np.mean(np.square(apart)))) < 4.0
