"""The node: samples into batches, batches to the gateway, and whatever breaks put right again."""

import asyncio
import gc
import os
import random
import struct
import sys
import time

from message_pack import Writer, read_map
from web_socket import ROOM

_STALLED_MS = 5000  # a message that does not go out, or a gateway that does not ask for the clock
_LOOK_MS = 250
_FIRST_PAUSE_MS = 500
_STEADY_MS = 3000  # who was welcome for so long is soon back, once cut off


class Refused(OSError):
    """The gateway said no. `wait_s`: when it makes sense to try again, None: after something was changed."""

    def __init__(self, said):
        super().__init__("%s: %s" % (said.get("code"), said.get("why")))
        self.wait_s = said.get("retry")


class Node:
    """`sensor` fills `batches`; `feed` is called as long as all is well; `asked` tells whether to end."""

    def __init__(self, configuration, sensor, batches, clock, battery, wifi, feed, asked):
        self._about = configuration
        self._sensor, self._batches, self._clock = sensor, batches, clock
        self._battery, self._wifi, self._feed = battery, wifi, feed
        self._boot = struct.unpack("<I", os.urandom(4))[0]
        self._writer = Writer(max(18 * configuration["batch"] + 128, 512), ROOM)
        self._waiting = asyncio.Event()
        batches.wake = self._waiting.set
        self._link = self._failure = self._joined = None
        self._heard = 0
        self._is_asked, self.asked = asked, False
        self._ends = False

    async def run(self):
        """Sample and send until the battery is empty or somebody asked for an end."""
        sampling = asyncio.create_task(self._sample())
        try:
            await self._keep_connected()
        finally:
            sampling.cancel()

    async def _sample(self):
        told = time.ticks_ms()
        while True:  # to the last goodbye: whoever does not feed the watchdog is started anew
            await asyncio.sleep_ms(self._about["poll_ms"])
            self._sensor.poll(self._clock.now)
            self._feed()
            if time.ticks_diff(time.ticks_ms(), told) >= 1000:
                told = time.ticks_add(told, 1000)
                self._sensor.clock.learn()
                self._battery.measure()
                self.asked = self.asked or self._is_asked()
                self._ends = self.asked or self._battery.empty()

    async def _keep_connected(self):
        pause = _FIRST_PAUSE_MS
        longest = self._about["longest_pause_s"] * 1000
        while not self._ends:
            self._joined, wait = None, 0
            try:
                await self._converse()
            except Refused as refused:
                print("refused:", refused)
                wait = longest if refused.wait_s is None else int(refused.wait_s * 1000)
            except (OSError, EOFError, ValueError, MemoryError, asyncio.TimeoutError) as error:
                print("no connection:", repr(error))
            gc.collect()
            if self._ends:
                return
            if self._joined is not None and time.ticks_diff(time.ticks_ms(), self._joined) > _STEADY_MS:
                pause = _FIRST_PAUSE_MS
            rest = max(min(wait, longest), pause // 2 + random.randrange(pause))
            while rest > 0 and not self._ends:
                await asyncio.sleep_ms(min(rest, _LOOK_MS))
                rest -= _LOOK_MS
            pause = min(2 * pause, longest)

    async def _converse(self):
        await self._wifi.join()
        gc.collect()
        import joining

        link, said = await joining.join(self._about, self._sensor, self._boot, self._writer)
        joining = None
        for name in ("joining", "discovery", "keeping"):
            sys.modules.pop(name, None)
        tasks = ()
        try:
            said = self._welcomed(read_map(said))
            self._link = link
            self._heard = self._joined = time.ticks_ms()
            self._batches.keeping = self._batches.connected = True
            self._failure = None
            tasks = [
                asyncio.create_task(self._until_it_fails(work, link))
                for work in (self._send, self._receive, self._tell)
            ]
            while self._failure is None and not self._ends:
                await asyncio.sleep_ms(_LOOK_MS)
                if link.stuck_ms() > _STALLED_MS or self._silent_ms() > _STALLED_MS:
                    raise OSError("the gateway has fallen silent")
            if self._failure is not None:
                raise self._failure
            await self._cancel(tasks)
            await self._say_bye(link)
        finally:
            self._link = None
            await self._cancel(tasks)
            self._batches.lost_connection()
            link.close()

    async def _until_it_fails(self, work, link):
        try:
            await work(link)
        except (OSError, EOFError, MemoryError) as error:
            self._failure = error

    async def _cancel(self, tasks):
        for task in tasks:
            task.cancel()
        await asyncio.sleep_ms(0)  # each gives back what it holds

    def _welcomed(self, said):
        """Raise what the gateway's first message is, if it is no welcome; keep nothing of it."""
        if said.get("m") == "refused/1":
            raise Refused(said)
        if said.get("m") != "welcome/1":
            raise OSError("a gateway says welcome, not %r" % said.get("m"))
        print("joined as", said.get("seg"), "of", said.get("sub"))

    def _silent_ms(self):
        return time.ticks_diff(time.ticks_ms(), self._heard)

    async def _send(self, link):
        batches = self._batches
        while True:
            batch = batches.next()
            if batch is None:
                self._waiting.clear()
                await self._waiting.wait()
                continue
            try:
                await link.send(batches.fill, batch)
            except BaseException:  # cancelled, too
                batches.unsent(batch)
                raise
            batches.sent(batch)

    async def _receive(self, link):
        while True:
            message = await link.receive()
            came = self._clock.now()
            self._heard = time.ticks_ms()
            said = read_map(message)
            kind = said.get("m")
            if kind == "clock/1":
                await link.send(self._clock_answer, said.get("id", 0), came)
            elif kind == "keep/1":
                import keeping

                stored = keeping.keep(said.get("cal"))
                keeping = None
                sys.modules.pop("keeping", None)
                if stored:
                    await link.send(_kept)
            elif kind == "refused/1":
                raise Refused(said)

    async def _tell(self, link):
        while True:
            await link.send(self._status)
            gc.collect()
            await asyncio.sleep_ms(1000)

    async def leave(self):
        """Say goodbye, so that what was lost at the end is counted too."""
        if self._link is not None:
            self._link.free()
            await self._say_bye(self._link)

    async def _say_bye(self, link):
        gc.collect()
        from leaving import say_bye

        await say_bye(link, self._batches, self._sensor.clock)

    def _clock_answer(self, writer, number, came):
        writer.begin(3, "clock/1")
        writer.whole("id", number)
        writer.whole("t1", came)
        writer.whole("t2", self._clock.now())

    def _status(self, writer):
        battery, signal = self._battery, self._wifi.signal_dbm()
        known = battery.volts is not None
        writer.begin((2 if known else 0) + (signal is not None) + 1, "status/1")
        if known:
            writer.real("bat", battery.volts)
            writer.real("bath", battery.hours)
        if signal is not None:
            writer.real("rssi", signal)
        writer.whole("drop", self._batches.dropped)


def _kept(writer):
    writer.begin(0, "kept/1")
