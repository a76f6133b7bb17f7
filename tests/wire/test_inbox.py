"""What waits between Zenoh's thread and a program: bounded, counted, and never without a wake."""

import threading

from brachium_wire.bus import Inbox


def test_a_full_inbox_drops_the_oldest_and_counts() -> None:
    inbox = Inbox(3)
    for number in range(10):
        inbox.put("k", b"%d" % number)
    assert (inbox.received, inbox.dropped) == (10, 7)
    assert inbox.drain() == [("k", b"7"), ("k", b"8"), ("k", b"9")]
    assert inbox.drain() == []
    assert not inbox.wait(0.0)


def test_what_is_there_before_on_arrival_wakes_too() -> None:
    inbox = Inbox(8)
    inbox.put("k", b"x")
    woken: list[int] = []
    inbox.on_arrival(lambda: woken.append(1))
    assert woken == [1]
    inbox.put("k", b"y")
    assert woken == [1]
    inbox.drain()
    inbox.put("k", b"z")
    assert woken == [1, 1]


def test_every_arrival_is_drained_after_a_wake_and_none_is_missed() -> None:
    inbox = Inbox(1_000_000)
    wake = threading.Semaphore(0)
    inbox.on_arrival(wake.release)
    total, writers = 20_000, 4

    def write() -> None:
        for _ in range(total // writers):
            inbox.put("k", b"x")

    threads = [threading.Thread(target=write) for _ in range(writers)]
    for thread in threads:
        thread.start()
    read = 0
    while read < total:  # a missed wake would leave this waiting with messages in the inbox
        assert wake.acquire(timeout=60.0), f"{read} of {total} read, and no wake"
        read += len(inbox.drain())
    for thread in threads:
        thread.join()
    assert (read, inbox.received, inbox.dropped) == (total, total, 0)


def test_counts_are_exact_when_it_overflows_while_it_is_read() -> None:
    inbox = Inbox(16)
    done = threading.Event()

    def write() -> None:
        for _ in range(20_000):
            inbox.put("k", b"x")
        done.set()

    writer = threading.Thread(target=write)
    writer.start()
    read = 0
    while not done.is_set():
        read += len(inbox.drain())
    writer.join()
    read += len(inbox.drain())
    assert inbox.received == 20_000
    assert read + inbox.dropped == 20_000
