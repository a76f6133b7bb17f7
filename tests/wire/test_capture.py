"""Capture folders: what is written is read back; what is wrong is named in one line."""

import os
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from brachium_body.segments import SEGMENTS
from brachium_wire import capture, table
from brachium_wire.capture import Capture, CaptureSegment
from brachium_wire.capture_settings import CalibrationSpans, CaptureError, CaptureSettings, Functional, Joint
from brachium_wire.messages import SensorCalibration

DATA = Path(os.environ.get("BRACHIUM_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
HEAD = "t,ax,ay,az,gx,gy,gz\n"
ROWS = "0.00,0,0,9.81,0,0,0\n0.01,0,0,9.81,0,0,0.5\n0.02,0,0,9.81,0,0,0\n"
FULL = CaptureSettings(
    title='a "quoted" title \x7f ü',
    side="left",
    rate_hz=100.0,
    lengths_m={"upper_arm": 0.33, "hand": 0.19},
    facing_deg=90.0,
    assumed_angles_deg={"elbow_flexion": 5.0},
    mounting={"forearm_l": (0.0, 1.0, 0.0, 0.0)},
    sensor={"forearm_l": SensorCalibration(gyro_bias=(0.01, 0.0, -0.01))},
    calibration=CalibrationSpans(
        pose="given",
        from_s=0.01,
        to_s=0.03,
        angles_deg={"elbow_flexion": 35.0},
        functional=(Functional(motion="elbow-flexion", from_s=0.04, to_s=0.06),),
    ),
    joint={"elbow": Joint(axes=2, centre_from={"upper_arm_l": (0.0, -0.14, 0.0)})},
)


def folder(
    tmp_path: Path, text: str = HEAD + ROWS, toml: str | None = None, name: str = "forearm_r.csv"
) -> Path:
    path = tmp_path / "capture"
    path.mkdir()
    (path / name).write_text(text)
    if toml is not None:
        (path / "capture.toml").write_text(toml)
    return path


def same(a: Capture, segments: dict[Any, CaptureSegment]) -> None:
    assert list(a.segments) == [name for name in SEGMENTS if name in segments]
    for name, segment in segments.items():
        for block in ("t", "acc", "gyr", "mag", "quat"):
            mine, theirs = getattr(a.segments[name], block), getattr(segment, block)
            assert (mine is None) == (theirs is None)
            if mine is not None:
                np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-15)


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 30))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=20, deadline=None)
def test_a_capture_comes_back(
    tmp_path_factory: Any, ending: Literal["csv", "parquet"], seed: int, n: int
) -> None:
    random = np.random.default_rng(seed)
    t = 40.0 + np.cumsum(random.uniform(0.05, 0.1, n))
    mag = random.normal(size=(n, 3))
    mag[random.random(n) < 0.3] = np.nan
    quat = random.normal(size=(n, 4))
    segments: dict[Any, CaptureSegment] = {
        "hand_l": CaptureSegment(t=t, rate_hz=1.0, quat=quat / np.linalg.norm(quat, axis=1, keepdims=True)),
        "forearm_l": CaptureSegment(
            t=t + 0.02,
            rate_hz=1.0,
            acc=random.normal(size=(n, 3)) + np.array([0.0, 0.0, 9.8]),
            gyr=random.normal(size=(n, 3)),
            mag=mag,
        ),
    }
    path = tmp_path_factory.mktemp("c") / "capture"
    capture.write(path, FULL, segments, ending)
    read = capture.load(path)
    same(read, segments)
    assert read.settings == FULL
    assert read.truth is None


def test_a_folder_of_one_csv_file_is_a_capture(tmp_path: Path) -> None:
    read = capture.load(folder(tmp_path))
    assert read.settings == CaptureSettings()
    assert read.warnings == ()
    segment = read.segments["forearm_r"]
    assert segment.rate_hz == pytest.approx(100.0)
    assert segment.mag is segment.quat is None
    assert segment.gyr is not None
    assert segment.gyr[1].tolist() == [0.0, 0.0, 0.5]


def test_rows_with_a_missing_number_are_left_out_counted_and_said(tmp_path: Path) -> None:
    text = HEAD + "0.00,0,0,9.81,0,0,0\n0.01,,0,9.81,0,0,0\n0.02,0,0,9.81,0,nan,0\n0.07,0,0,9.81,0,0,0\n"
    read = capture.load(folder(tmp_path, text))
    segment = read.segments["forearm_r"]
    assert segment.t.tolist() == [0.0, 0.07]  # the gap stays a gap
    assert segment.dropped == 2
    assert read.warnings == ("forearm_r: 2 rows left out, because a number is missing",)


def test_a_slow_magnetometer_leaves_the_other_numbers(tmp_path: Path) -> None:
    text = "t,ax,ay,az,gx,gy,gz,mx,my,mz\n0,0,0,9.8,0,0,0,1,2,3\n1,0,0,9.8,0,0,0,,,\n"
    segment = capture.load(folder(tmp_path, text)).segments["forearm_r"]
    assert len(segment.t) == 2
    assert segment.mag is not None
    assert np.isnan(segment.mag).all(axis=1).tolist() == [False, True]


def test_the_nominal_rate_is_the_files_only_where_it_fits(tmp_path: Path) -> None:
    path = folder(tmp_path, toml="rate_hz = 101.0")
    (path / "hand_r.csv").write_text(HEAD + ROWS.replace("0.02", "0.05").replace("0.01", "0.025"))
    read = capture.load(path)
    assert read.segments["forearm_r"].rate_hz == 101.0
    assert read.segments["hand_r"].rate_hz == pytest.approx(40.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x,y\n0,1\n", "column t"),
        ("t,ax,ay,az,gx,gy\n0,0,0,9,0,0\n", "column gz is missing"),
        ("t,ax,ay,az\n0,0,0,9\n", "expected ax ay az and gx gy gz"),
        ("t,ax,ay,az,qw,qx,qy,qz\n0,0,0,9,1,0,0,0\n", "belong together"),
        ("t,mx,my,mz\n0,0,0,9\n", "expected ax ay az"),
        (HEAD + "0,0,0,9.8,0,0,0\n", "1 whole row, at least two"),
        (HEAD, "0 whole rows"),
        (HEAD + ROWS + "0.02,0,0,9.8,0,0,0\n", "data row 4 has 0.020000 after 0.020000"),
        (HEAD + "0,0,0,9.8,0,0,oops\n", "data row 1, column gz holds text, 'oops'"),
        ("t,qw,qx,qy,qz\n0,1,0,0,0\n1,0,0,0,0\n", "length 0.000"),
    ],
)
def test_a_wrong_segment_file_is_named_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(CaptureError, match=said) as caught:
        capture.load(folder(tmp_path, text))
    assert "forearm_r.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("toml", "said"),
    [
        ("side = 'up'", "side: 'up' is not known; write right, left or both"),
        ("side = 3", "side: expected right, left or both, came a whole number"),
        ("heigth_m = 1.8", "'heigth_m'; did you mean 'height_m'"),
        ("height_m = -1", "height_m = -1: expected metres, above 0 and at most 3"),
        ("height_m = 'tall'", "height_m: expected a number, came text"),
        ("lengths_m = { hand = 19 }", "lengths_m.hand = 19: expected metres"),
        ("lengths_m = { foot = 1 }", "lengths_m: 'foot' is not known; write chest_to_shoulder, upper_arm, "),
        ("rate_hz = '100'", "rate_hz: expected a number, came text"),
        ("rate_hz = 0", "rate_hz = 0: expected 1 to 2000"),
        ("rate_hz = 2001", "rate_hz = 2001: expected 1 to 2000"),
        ("facing_deg = 361", "facing_deg = 361: expected degrees, -360 to 360"),
        (
            "assumed_angles_deg = { elbow_flexion = 400 }",
            "assumed_angles_deg.elbow_flexion = 400: no joint does that; expected degrees, -15 to 160",
        ),
        (
            "assumed_angles_deg = { shoulder_flexion = 4 }",
            "assumed_angles_deg.shoulder_flexion: no angle",
        ),
        (
            "[calibration]\npose = 'given'\nto_s = 0.02\nangles_deg = { elbow_flexion = 350 }",
            "calibration.angles_deg.elbow_flexion = 350: no joint does that; expected degrees, -15 to 160",
        ),
        (
            "[calibration]\npose = 'given'\nto_s = 0.02\nangles_deg = { elbow_flexion = nan }",
            "elbow_flexion = nan: no joint",
        ),
        (
            "[calibration]\npose = 'given'\nto_s = 0.02\nangles_deg = { elbow = 35 }",
            "calibration.angles_deg.elbow: no angle that can be stated; expected elbow_flexion, ",
        ),
        ("[calibration]\npose = 'given'\nto_s = 0.02", "the pose given needs the angles that are held"),
        (
            "[calibration]\npose = 'n-pose'\nto_s = 0.02\nangles_deg = { elbow_flexion = 5 }",
            'angles_deg belongs to pose = "given"',
        ),
        ("facing_deg = nan", "facing_deg = nan: expected degrees, -360 to 360"),
        ("mounting = 3", "mounting: expected a table"),
        ("sensor = { forearm_r = 3 }", "sensor.forearm_r: expected a table"),
        ("joint = 3", "joint: expected a table"),
        ("[mounting]\nforarm_r = [1,0,0,0]", "did you mean 'forearm_r'"),
        ("[mounting]\nforearm_r = [1,1,0,0]", "no rotation"),
        ("[mounting]\nforearm_r = [1,0,0]", "mounting: expected 4 numbers, came 3"),
        ("[mounting]\nforearm_r = [nan,0,0,0]", "no rotation"),
        ("[sensor.forearm_r]\ngyro_bais = [0,0,0]", "did you mean 'gyro_bias'"),
        ("[calibration]\npose = 'n-pose'", "to_s"),
        (
            "[calibration]\npose = 'lotus'\nto_s = 3",
            "calibration.pose: 'lotus' is not known; write n-pose",
        ),
        ("[calibration]\nfrom_s = 4\nto_s = 3", "must come after"),
        ("[calibration]\nform_s = 4", "calibration: unknown entry 'form_s'; did you mean 'from_s'"),
        ("[[calibration.functional]]\nmotion = 'free'\nfrom_s = 4\nto_s = 4", "functional"),
        ("[[calibration.functional]]\nmotion = 'free'\nto_s = 4", "functional.0.: from_s is missing"),
        ("[joint.elbow]\naxes = 4", "1, 2 or 3"),
        ("[joint.elbow]\naxes = 2\nfrom_forearm = [0,0,0]", "did you mean 'from_forearm_r'"),
        ("[joint.knee]\naxes = 2", "joint: 'knee' is not known; joints are shoulder, elbow, wrist"),
        ("side = ", "not TOML"),
    ],
)
def test_a_wrong_entry_is_named_in_one_line(tmp_path: Path, toml: str, said: str) -> None:
    with pytest.raises(CaptureError, match=said) as caught:
        capture.load(folder(tmp_path, toml=toml))
    assert "capture.toml" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "`" not in str(caught.value)  # the marks of the library's own words


def test_a_capture_toml_that_is_no_text_says_so(tmp_path: Path) -> None:
    path = folder(tmp_path)
    (path / "capture.toml").write_bytes(b"title = '\xff\xfe'")
    with pytest.raises(CaptureError, match=r"capture\.toml: not text \(UTF-8\)"):
        capture.load(path)


def test_a_misspelt_segment_is_named_with_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="'fore_arm_r'; did you mean 'forearm_r'"):
        capture.load(folder(tmp_path, name="fore_arm_r.csv"))


def test_a_folder_without_segments_says_what_it_wants(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="no segment file; write <segment>"):
        capture.load(folder(tmp_path, name="imu1.csv"))
    with pytest.raises(CaptureError, match="no such folder"):
        capture.load(tmp_path / "nowhere")


def test_other_tables_beside_the_segments_are_left_aside_and_said(tmp_path: Path) -> None:
    path = folder(tmp_path)
    (path / "angles.csv").write_text("time,x\n0,1\n")
    (path / "truth.csv").write_text("t,x\n0,1\n")
    read = capture.load(path)
    assert list(read.segments) == ["forearm_r"]
    assert read.warnings == ("angles.csv is no segment and was left aside",)
    assert read.truth == path / "truth.csv"


def test_one_segment_in_two_files_is_refused(tmp_path: Path) -> None:
    path = folder(tmp_path)
    table.write(path / "forearm_r.parquet", {"t": [0.0]}, {}, {})
    with pytest.raises(CaptureError, match=r"forearm_r\.csv and forearm_r\.parquet"):
        capture.load(path)


def test_accelerations_that_are_far_too_large_are_doubted_aloud(tmp_path: Path) -> None:
    text = HEAD + "0.00,0,0,32.2,0,0,0\n0.01,0,0,32.2,250,0,0\n0.02,0,0,32.2,9,0,0\n"
    assert [w.split(":")[1][:20] for w in capture.load(folder(tmp_path, text)).warnings] == [
        " half of all acceler",
        " 1 row left out, bec",
    ]


@pytest.mark.parametrize(
    ("size", "said"), [(1.0, "looks like g: multiply by 9.80665"), (0.1, "is gravity taken out of them")]
)
def test_accelerations_without_gravity_are_refused(tmp_path: Path, size: float, said: str) -> None:
    rows = ROWS.replace("9.81", f"{size}")
    with pytest.raises(CaptureError, match=rf"forearm_r\.csv: .* expected m/s\^2 .*{said}"):
        capture.load(folder(tmp_path, HEAD + rows))


def turning(unit: float, largest: float, seconds: float = 20.0) -> str:
    """Return a sensor that is tilted to and fro about x by a known rate, its rates times `unit`."""
    t = np.arange(round(50.0 * seconds)) / 50.0
    tilt = largest / 2.0 * np.sin(2.0 * t)
    rate = unit * largest * np.cos(2.0 * t)
    rows = zip(t, 9.81 * np.sin(tilt), 9.81 * np.cos(tilt), rate, strict=True)
    return HEAD + "".join(f"{t:.3f},0,{y:.6f},{z:.6f},{x:.6f},0,0\n" for t, y, z, x in rows)


@pytest.mark.parametrize(("largest", "said"), [(0.5, "gravity's direction"), (3.0, "rows reach above 100")])
def test_angular_rates_in_degrees_are_refused(tmp_path: Path, largest: float, said: str) -> None:
    with pytest.raises(CaptureError, match=rf"{said}.*expected rad/s; this looks like deg/s"):
        capture.load(folder(tmp_path, turning(180.0 / np.pi, largest)))


@pytest.mark.parametrize("largest", [0.0, 0.5, 3.0, 20.0])
@pytest.mark.parametrize("unit", [1.0, -1.0])
def test_angular_rates_in_radians_are_taken(tmp_path: Path, largest: float, unit: float) -> None:
    assert capture.load(folder(tmp_path, turning(unit, largest))).warnings == ()


@pytest.mark.parametrize(
    ("column", "value", "wrong"),
    [("ax", "-501", 1), ("gz", "101", 1), ("mx", "10001", 1), ("ax", "500", 0), ("gz", "-100", 0)],
)
def test_what_no_sensor_measures_is_left_out_counted_and_said(
    tmp_path: Path, column: str, value: str, wrong: int
) -> None:
    head = ["t", "ax", "ay", "az", "gx", "gy", "gz", "mx", "my", "mz"]
    rows = [dict.fromkeys(head, "1") | {"t": f"0.0{i}", "az": "9.8"} for i in range(5)]
    rows[2][column] = value
    text = "\n".join([",".join(head), *(",".join(row.values()) for row in rows)]) + "\n"
    read = capture.load(folder(tmp_path, text))
    assert read.segments["forearm_r"].dropped == read.segments["forearm_r"].beyond == wrong
    assert len(read.segments["forearm_r"].t) == 5 - wrong
    assert [w[:26] for w in read.warnings] == ["forearm_r: 1 row left out,"] * wrong


@pytest.mark.parametrize("t", ["inf", "-inf", "4.1e9", "-4.1e9"])
def test_a_time_out_of_reason_is_named_with_its_row(tmp_path: Path, t: str) -> None:
    with pytest.raises(CaptureError, match=r"forearm_r\.csv: data row 4: t .*expected seconds"):
        capture.load(folder(tmp_path, HEAD + ROWS + f"{t},0,0,9.8,0,0,0\n"))


EIGHT_SECONDS = HEAD + "".join(f"{40 + i / 10},0,0,9.81,0,0,0\n" for i in range(81))


@pytest.mark.parametrize(
    ("toml", "said"),
    [
        ("[calibration]\npose = 'n-pose'\nfrom_s = 100\nto_s = 103", "calibration: to_s = 103 lies after"),
        ("[calibration]\nfrom_s = 9", "calibration: from_s = 9 lies after"),
        (
            "[[calibration.functional]]\nmotion = 'free'\nfrom_s = 4\nto_s = 8.5",
            "calibration.functional free: to_s = 8.5 lies after",
        ),
    ],
)
def test_a_span_outside_the_recording_is_refused(tmp_path: Path, toml: str, said: str) -> None:
    with pytest.raises(CaptureError, match=said + " the recording's end at 8.0 s"):
        capture.load(folder(tmp_path, EIGHT_SECONDS, toml))


def test_a_span_up_to_the_end_is_taken(tmp_path: Path) -> None:
    read = capture.load(folder(tmp_path, EIGHT_SECONDS, "[calibration]\nfrom_s = 4\nto_s = 8.0"))
    assert read.settings.calibration.to_s == 8.0


def test_segments_that_share_no_time_are_named(tmp_path: Path) -> None:
    path = folder(tmp_path)
    (path / "hand_r.csv").write_text(HEAD + "".join(f"{1e6 + i / 100},0,0,9.8,0,0,0\n" for i in range(3)))
    with pytest.raises(CaptureError, match="hand_r: begins at t = 1000000 s, after forearm_r ended at 0"):
        capture.load(path)


@pytest.mark.parametrize(
    ("period", "toml", "said"),
    [
        (10.0, "rate_hz = 100", "10 s apart, but rate_hz = 100; t is in seconds; this looks like millisec"),
        (10.0, None, "10 s apart; t is in seconds; this looks like milliseconds"),
        (1e4, "rate_hz = 100", "this looks like microseconds"),
        (
            1e-4,
            "rate_hz = 100",
            "0.0001 s apart, but rate_hz = 100; t is in seconds; this looks like another",
        ),
    ],
)
def test_other_units_of_time_are_refused(tmp_path: Path, period: float, toml: str | None, said: str) -> None:
    text = HEAD + "".join(f"{i * period},0,0,9.8,0,0,0\n" for i in range(5))
    with pytest.raises(CaptureError, match="forearm_r: samples are .*" + said):
        capture.load(folder(tmp_path, text, toml))


def test_tables_of_the_other_side_are_named_with_it(tmp_path: Path) -> None:
    path = folder(tmp_path, toml='side = "left"')
    with pytest.raises(CaptureError, match=r'side = "left".*the right side: forearm_r; write side = "right"'):
        capture.load(path)
    (path / "hand_l.csv").write_text(HEAD + ROWS)
    assert list(capture.load(path).segments) == ["forearm_r", "hand_l"]


def test_an_existing_capture_is_not_written_over(tmp_path: Path) -> None:
    path = folder(tmp_path)
    with pytest.raises(CaptureError, match="not empty"):
        capture.write(path, CaptureSettings(), {})


@pytest.mark.data
@pytest.mark.skipif(not DATA.is_dir(), reason=f"no recordings at {DATA}; set BRACHIUM_DATA")
def test_the_real_recordings_are_captures() -> None:
    counts = {}
    for path in sorted(DATA.iterdir()):
        if path.is_dir():
            read = capture.load(path)
            counts[path.name] = len(read.segments)
            assert read.warnings == ()
            assert (read.truth is None) == (path.name == "human_arms")
    assert counts
    assert set(counts.values()) <= {1, 2, 7}


def test_without_settings_the_side_is_that_of_the_tables(tmp_path: Path) -> None:
    left = tmp_path / "left"
    left.mkdir()
    (left / "forearm_l.csv").write_text(HEAD + ROWS)
    assert capture.load(left).settings.side == "left"
    (left / "hand_r.csv").write_text(HEAD + ROWS)
    assert capture.load(left).settings.side == "both"


def test_a_row_without_a_time_costs_that_row_alone(tmp_path: Path) -> None:
    read = capture.load(folder(tmp_path, HEAD + ROWS + ",0,0,9.8,0,0,0\n"))
    assert read.segments["forearm_r"].dropped == 1
