"""Where nodes come in: a listening socket, and an end that every node hears."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from brachium_nodes.node_socket import CLOSE_WITHIN_S, House, NodeSocket

BACKLOG = 512
"""A room of nodes that all come back at once, as after the gateway's restart."""
ENDINGS = 20
"""How often it is looked, within a second, whether all nodes have heard that the gateway ends."""


@asynccontextmanager
async def listening(house: House, address: str, port: int) -> AsyncIterator[int]:
    """Take connections as long as the context lasts; yield the port. Raises OSError."""
    server = await asyncio.get_running_loop().create_server(
        lambda: NodeSocket(house), address, port, backlog=BACKLOG
    )
    try:
        yield int(server.sockets[0].getsockname()[1])
    finally:
        server.close()
        for socket in house.sockets.copy():
            socket.close(1001, "the gateway ends")
        for _ in range(ENDINGS):
            if not house.sockets:
                break
            await asyncio.sleep(CLOSE_WITHIN_S / ENDINGS)
        for socket in house.sockets.copy():
            socket.abort()
        await asyncio.sleep(0)  # a transport that is aborted closes in the next turn of the loop
