"""The topic table agrees with the keys and with itself."""

from brachium_wire import keys
from brachium_wire.codec import encode
from brachium_wire.samples import write_samples
from brachium_wire.topics import TOPICS, Urgency

PARTS = {
    "<subject>": "p01",
    "<segment>": "hand_r",
    "<side>": "right",
    "<verb>": "zero",
    "<kind>": "fusion",
    "<id>": "f1",
}


def test_each_pattern_is_the_key_of_its_topic() -> None:
    for name, row in TOPICS.items():
        key = row.pattern
        for placeholder, part in PARTS.items():
            key = key.replace(placeholder, part)
        assert row.name == name
        assert keys.parse(f"brachium/gym/{key}").topic == name


def test_info_shares_the_queue_of_the_batches_it_must_stay_ahead_of() -> None:
    assert TOPICS["info"].urgency is TOPICS["imu"].urgency is Urgency.DATA


def test_only_what_stays_true_is_retained() -> None:
    assert {name for name, row in TOPICS.items() if row.retained} == {"info", "calibration", "session"}


def test_a_second_of_samples_at_100_hz_fits_the_topic() -> None:
    n = 100
    batch = write_samples(
        sequence=1 << 40,
        time_ns=[(1 << 60) + 10_000_000 * i for i in range(n)],
        device_us=[(1 << 50) + 10_000 * i for i in range(n)],
        received_ns=1 << 60,
        uncertainty_ns=1 << 30,
        acc=[[1.0, 2.0, 3.0]] * n,
        gyr=[[1.0, 2.0, 3.0]] * n,
        mag=[[1.0, 2.0, 3.0]] * n,
        quat=[[1.0, 0.0, 0.0, 0.0]] * n,
    )
    assert len(encode(batch)) <= TOPICS["imu"].max_bytes
