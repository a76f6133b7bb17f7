"""A relay on loopback that passes bytes on, and for a while does not: a radio that is shaded."""

import asyncio
import threading
from collections.abc import Callable


class StallingRelay:
    """Passes connections to `port` on, in a thread of its own; use it in a `with`."""

    def __init__(self, own_port: int, port: int) -> None:
        self._own_port, self._port = own_port, port
        self._loop = asyncio.new_event_loop()
        self._open = asyncio.Event()
        self._open.set()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def stall(self) -> None:
        """Let nothing through any more."""
        self._loop.call_soon_threadsafe(self._open.clear)

    def go_on(self) -> None:
        """Let everything through again."""
        self._loop.call_soon_threadsafe(self._open.set)

    def __enter__(self) -> "StallingRelay":
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._loop.call_soon_threadsafe(self._stop)
        self._thread.join()

    def _stop(self) -> None:
        for task in asyncio.all_tasks(self._loop):
            task.cancel()

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        except asyncio.CancelledError:
            pass
        finally:
            self._loop.run_until_complete(self._loop.shutdown_asyncgens())
            self._loop.close()

    async def _serve(self) -> None:
        server = await asyncio.start_server(self._join, "127.0.0.1", self._own_port)
        async with server:
            await server.serve_forever()

    async def _join(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self._port)
        except OSError:
            writer.close()
            return
        await asyncio.gather(
            self._pass(reader, writer=far_writer, close=writer.close),
            self._pass(far_reader, writer=writer, close=far_writer.close),
            return_exceptions=True,
        )

    async def _pass(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, close: Callable[[], None]
    ) -> None:
        try:
            while data := await reader.read(4096):
                await self._open.wait()
                writer.write(data)
                await writer.drain()
        finally:
            writer.close()
            close()
