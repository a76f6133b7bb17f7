"""What a tracker that was let in sends and is asked, in messages for the bus. Pure."""

from collections import Counter

from brachium_nodes.slimevr import answers
from brachium_nodes.slimevr import records as r
from brachium_nodes.slimevr.actions import Action, Publish, Send
from brachium_nodes.slimevr.tracker import STILL_NS, Sensor, Tracker, batch_of
from brachium_wire.messages import Event, Info, Quaternion, Status
from brachium_wire.samples import MAX_SAMPLES

ASK_NS = 500_000_000
"""Between two questions whether a tracker is there, with a ping; its own server asks as often."""


def take(
    tracker: Tracker, record: r.Record, now_ns: int, counts: Counter[str], drops: Counter[str]
) -> list[Action]:
    """Take what is no sample."""
    match record:
        case r.Pong(ping_id):
            if not tracker.trips.back(ping_id, now_ns):
                drops["unasked_ping"] += 1
        case r.Battery(volts, level):
            tracker.battery_v, tracker.battery_level = volts, level
        case r.Signal(dbm):
            tracker.rssi_dbm = float(dbm)
        case r.Features():
            return [Send(tracker.address, answers.FEATURES)]
        case r.Tap(sensor, value):
            return _tap(tracker, sensor, value, now_ns)
        case r.Acceleration():
            counts["accelerations_unused"] += 1
        case r.Trouble(_, code):
            counts[f"sensor_error_{code}"] += 1
    return []


def samples(
    tracker: Tracker, datagram: r.Datagram, lost: int, now_ns: int, drops: Counter[str]
) -> list[Action]:
    """Return the batches that a datagram brings, one a sensor: what it carries, or that a sensor rests."""
    turns: dict[int, list[Quaternion]] = {}
    alive = False
    measured = any(isinstance(record, r.Rotation | r.Acceleration) for record in datagram.records)
    for record in datagram.records:
        if isinstance(record, r.Rotation):
            turns.setdefault(record.sensor, []).append(record.world_from_sensor)
        alive = alive or (isinstance(record, r.Heartbeat) and datagram.number != 0)
    drops["no_sensor"] += sum(len(q) for s, q in turns.items() if s not in tracker.sensors)
    actions: list[Action] = []
    for number, sensor in tracker.sensors.items():
        came = turns.get(number, [])[-MAX_SAMPLES:]
        sensor.datagram(lost, len(came), measured=measured)
        sensor.answered += alive
        if sensor.admission is None:
            drops["no_segment"] += len(came)
        elif came:
            actions.append(_turned(tracker, sensor, came, now_ns))
        elif alive and sensor.is_silent(now_ns) and sensor.rests:
            actions += _rested(tracker, sensor, now_ns)
    return actions


def _turned(tracker: Tracker, sensor: Sensor, came: list[Quaternion], now_ns: int) -> Action:
    missed = sensor.rotated(came[-1], now_ns)
    last_ns = now_ns - tracker.trips.delay_ns
    times = [last_ns - (len(came) - 1 - i) * _period_ns(sensor) for i in range(len(came))]
    return _publish(tracker, sensor, came, times, missed, now_ns)


def _rested(tracker: Tracker, sensor: Sensor, now_ns: int) -> list[Action]:
    """Return the samples of a sensor that is known to rest, from the last one given until now."""
    assert sensor.admission is not None
    assert sensor.orientation is not None
    period_ns, newest_ns = _period_ns(sensor), sensor.admission.place.newest_ns
    n = min((now_ns - tracker.trips.delay_ns - newest_ns) // period_ns, MAX_SAMPLES)
    if n < 1:
        return []
    times = [newest_ns + (i + 1) * period_ns for i in range(n)]
    return [_publish(tracker, sensor, [sensor.orientation] * n, times, 0, now_ns)]


def _publish(
    tracker: Tracker,
    sensor: Sensor,
    orientations: list[Quaternion],
    times_ns: list[int],
    missed: int,
    now_ns: int,
) -> Action:
    assert sensor.admission is not None
    batch = batch_of(
        sensor,
        orientations,
        times_ns,
        missed=missed,
        received_ns=now_ns,
        uncertainty_ns=tracker.trips.uncertainty_ns,
    )
    return Publish("imu", sensor.admission.subject, sensor.admission.segment, batch)


def _period_ns(sensor: Sensor) -> int:
    assert sensor.hello is not None
    return round(1e9 / sensor.hello.rate_hz)


def _tap(tracker: Tracker, number: int, value: int, now_ns: int) -> list[Action]:
    sensor = tracker.sensors.get(number)
    if sensor is None or sensor.admission is None:
        return []
    place = sensor.admission
    tap = Event(
        time_ns=now_ns - tracker.trips.delay_ns,
        kind="tap",
        text=f"{place.segment} tapped",
        data={"segment": place.segment, "node": sensor.node, "value": value},
    )
    return [Publish("event", place.subject, place.segment, tap)]


def ask(tracker: Tracker, now_ns: int) -> list[Action]:
    """Return the questions that are due: is it there, how far is it, and does it rest."""
    actions: list[Action] = []
    silent = [s for s in tracker.sensors.values() if s.is_silent(now_ns)]
    due = now_ns >= tracker.ask_ns
    if due or (silent and now_ns >= tracker.still_ns):
        tracker.still_ns = now_ns + STILL_NS
        for sensor in tracker.sensors.values():
            sensor.asked += 1
        actions.append(Send(tracker.address, answers.HEARTBEAT))
    if due:
        tracker.ask_ns = now_ns + ASK_NS
        actions.append(Send(tracker.address, answers.ping(tracker.trips.ask(now_ns))))
    return actions


def info(tracker: Tracker, sensor: Sensor, host: str) -> Action:
    """Return what is known of a sensor that was let in."""
    assert sensor.admission is not None
    assert sensor.hello is not None
    said = Info(
        node=sensor.node,
        rate_hz=sensor.hello.rate_hz,
        origin="worn",
        host=host,
        chip=sensor.hello.chip,
        firmware=tracker.handshake.firmware,
        mounting=sensor.admission.entry.mounting,
        orientation_only=True,
        heading_free=not sensor.info.magnetometer,
    )
    return Publish("info", sensor.admission.subject, sensor.admission.segment, said)


def status(tracker: Tracker, sensor: Sensor, now_ns: int, *, connected: bool = True) -> list[Action]:
    """Return how a sensor fares; nothing for one that stands for no segment."""
    if sensor.admission is None:
        return []
    memory, elapsed_ns = sensor.admission.memory, now_ns - sensor.counted_ns
    received = memory.counter.received
    rate_hz = (received - sensor.counted) * 1e9 / elapsed_ns if elapsed_ns > ASK_NS else None
    sensor.counted_ns, sensor.counted = now_ns, received
    said = Status(
        node=sensor.node,
        time_ns=now_ns,
        connected=connected,
        received=received,
        lost=memory.counter.lost,
        out_of_order=0,
        rate_hz=rate_hz,
        battery_v=tracker.battery_v,
        battery_level=tracker.battery_level,
        rssi_dbm=tracker.rssi_dbm,
        clock_uncertainty_ns=tracker.trips.uncertainty_ns,
    )
    return [Publish("status", sensor.admission.subject, sensor.admission.segment, said)]
