import asyncio

from brachium_viewer.web.seats import ANSWERS, Seat


def test_a_slow_screen_gets_the_newest_frame_and_state_and_all_its_answers():
    async def run() -> list[str]:
        seat = Seat()
        for number in range(100):
            seat.put_frame(f"frame {number}")
            seat.put_state(f"state {number}")
        seat.put_answer("first")
        seat.put_answer("second")
        seat.put_state("state 100")
        seat.put_state("state 101")
        taken = await seat.take()
        assert seat.skipped == 99
        return taken

    assert asyncio.run(run()) == ["state 99", "first", "second", "state 101", "frame 99"]


def test_who_asks_and_never_reads_loses_the_oldest_answers():
    async def run() -> list[str]:
        seat = Seat()
        for number in range(1000):
            seat.put_answer(str(number))
        return await seat.take()

    assert asyncio.run(run()) == [str(number) for number in range(1000 - ANSWERS, 1000)]


def test_taking_waits_until_something_is_there():
    async def run() -> list[str]:
        seat = Seat()
        taking = asyncio.create_task(seat.take())
        await asyncio.sleep(0)
        assert not taking.done()
        seat.put_frame("frame")
        return await taking

    assert asyncio.run(run()) == ["frame"]
