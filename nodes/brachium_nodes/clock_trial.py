"""How well a node's clock is known over a simulated radio: what a gateway sees, and the truth beside it."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_nodes.clock import NodeClock
from brachium_nodes.conversation import ASK_NS, ASK_OFTEN_FOR_NS, ASK_OFTEN_NS
from brachium_nodes.link import WIFI, Delay

Array = npt.NDArray[np.float64]

HOST_S = 1_700_000_000.0
"""Host time at true time 0."""
PACKET_S = 0.05
THINKING_S = 0.3e-3
"""Scale of the time a node takes for an answer (gamma, shape 2): what lies between t1 and t2 does no harm."""


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """What became of each batch: when its sample was taken (s), and its error and stated uncertainty (ns)."""

    taken_s: Array
    published_ns: npt.NDArray[np.int64]
    error_ns: npt.NDArray[np.int64]
    stated_ns: npt.NDArray[np.int64]
    first_late_s: float
    """How late the very first batch came."""
    skew: float

    def first_message_error_ns(self, taken_s: float) -> float:
        """Return the error at `taken_s` of a clock that takes the first batch's offset for good."""
        return 1e9 * (self.first_late_s + self.skew * taken_s)


def trial(
    seed: int,
    seconds: float,
    *,
    skew_ppm: float = 50.0,
    delay: Delay = WIFI["busy"],
    clock_s: float = 123.456,
) -> Trial:
    """Return what one node's clock is taken for over `seconds`, 20 batches a second.

    `clock_s` is what the node's clock shows at true time 0.
    """
    random, skew = np.random.default_rng(seed), skew_ppm * 1e-6

    def device_us(time_s: Array) -> list[int]:
        return [int(us) for us in np.floor(1e6 * (clock_s + time_s * (1.0 + skew)))]

    taken = np.arange(0.0, seconds, PACKET_S) + random.uniform(0.0, PACKET_S)
    asked = _questions(seconds) + random.uniform(0.0, PACKET_S)
    # Batches and answers share one connection: none overtakes another.
    down = np.maximum.accumulate(asked + delays(random, asked, delay))
    left = down + random.gamma(2.0, THINKING_S, len(asked))
    sent = np.concatenate([taken, left])
    order = np.argsort(sent)
    arrived = np.empty(len(sent))
    arrived[order] = np.maximum.accumulate(sent[order] + delays(random, sent[order], delay))
    happenings = sorted(
        [(a, d, t, -1) for a, d, t in zip(arrived, device_us(taken), taken.tolist(), strict=False)]
        + [
            (a, d, 0.0, number)
            for number, (a, d) in enumerate(zip(arrived[len(taken) :], device_us(left), strict=True))
        ]
    )
    came_us, asked_ns = device_us(down), [_host_ns(t) for t in asked.tolist()]
    clock = NodeClock()
    rows: list[tuple[float, int, int, int]] = []
    for arrived_s, us, taken_s, number in happenings:
        now_ns = _host_ns(arrived_s)
        if number >= 0:
            clock.exchange(asked_ns[number], came_us[number], us, now_ns)
            continue
        if clock.known:
            (published,) = clock.host_times([us])
            clock.publish(us)
            rows.append((taken_s, published, published - _host_ns(taken_s), clock.uncertainty_ns(us)))
        clock.arrival(us, now_ns)
    times, published_ns, errors, stated = zip(*rows, strict=True)
    late_s = float(arrived[0] - taken[0])
    return Trial(np.array(times), np.array(published_ns), np.array(errors), np.array(stated), late_s, skew)


def delays(random: np.random.Generator, sent_s: Array, delay: Delay) -> Array:
    """Return one-way delays (n,), s, of messages sent at ascending times (n,), s.

    Base and gamma jitter; and bursts of Pareto length, in which what is sent waits for the end.
    """
    out: Array = delay.base_s + random.gamma(delay.jitter_shape, delay.jitter_scale_s, len(sent_s))
    if not len(sent_s) or delay.burst_rate_hz == 0.0:
        return out
    length_s = float(sent_s[-1] - sent_s[0])
    begins = sent_s[0] + np.sort(
        random.uniform(0.0, length_s, random.poisson(delay.burst_rate_hz * length_s))
    )
    for begin in begins:
        end = begin + min(delay.burst_s * (1.0 + random.pareto(2.0)), delay.burst_longest_s)
        within = slice(*np.searchsorted(sent_s, [begin, end]))
        out[within] = np.maximum(out[within], end - sent_s[within])
    return out


def _questions(seconds: float) -> Array:
    often = np.arange(0.0, min(seconds, ASK_OFTEN_FOR_NS * 1e-9), ASK_OFTEN_NS * 1e-9)
    return np.concatenate([often, np.arange(often[-1] + ASK_OFTEN_NS * 1e-9, seconds, ASK_NS * 1e-9)])


def _host_ns(time_s: float) -> int:
    return round(HOST_S * 1e9) + round(time_s * 1e9)
