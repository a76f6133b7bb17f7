"""The yardstick of the gateway: a bare WebSocket server that sends back what comes, and nothing else.

python -m brachium.bench_echo PORT
"""

import asyncio
import sys

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from brachium.shell import stop_on_signals


async def echo(port: int) -> None:
    """Serve until SIGTERM, with the gateway's own settings."""
    stop = stop_on_signals()
    async with serve(_again, "127.0.0.1", port, compression=None, max_size=4096, ping_interval=5):
        while not stop.is_set():
            await asyncio.sleep(0.05)


async def _again(socket: ServerConnection) -> None:
    try:
        async for message in socket:
            await socket.send(message)
    except ConnectionClosed:
        return


if __name__ == "__main__":
    asyncio.run(echo(int(sys.argv[1])))
