"""One node's WebSocket at the gateway: moves bytes and time between the socket and the conversation."""

import asyncio
from collections.abc import Callable

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from brachium_nodes.conversation import Action, Close, Conversation, Publish, Send
from brachium_nodes.roster import Admission
from brachium_wire.hosttime import HostClock
from brachium_wire.messages import Message

TICK_S = 0.05
TOO_BIG = 1009


class Connection:
    """Drives one conversation until either side ends it.

    `publish(admission, topic, message)` must not block; `left(connection)` is called once, when the node is
    gone or another connection took its place.
    """

    def __init__(
        self,
        socket: ServerConnection,
        conversation: Conversation,
        clock: HostClock,
        publish: Callable[[Admission, str, Message], None],
        left: Callable[["Connection"], None],
    ) -> None:
        self.conversation = conversation
        self._socket, self._clock, self._publish, self._left = socket, clock, publish, left
        self._gone = False
        self.replaced = False
        """Another connection of the same node took over: this one says nothing more of it."""

    async def run(self) -> None:
        """Serve until the connection is closed."""
        ticker = asyncio.create_task(self._tick())
        oversize = False
        try:
            async for payload in self._socket:
                await self.do(self.conversation.receive(payload, self._clock.now_ns()))
        except ConnectionClosed as error:
            oversize = error.sent is not None and error.sent.code == TOO_BIG
        finally:
            ticker.cancel()
            self._finish(oversize=oversize)

    async def do(self, actions: list[Action]) -> None:
        """Carry out what the conversation asks for. A peer that is gone is no error here."""
        for action in actions:
            try:
                match action:
                    case Publish():
                        self._share(action)
                    case Send():
                        await self._socket.send(action.frame)
                    case Close():
                        self._finish()  # before the close: who waits for it finds the counts final
                        await self._socket.close(action.code, action.reason)
            except ConnectionClosed:
                continue

    async def _tick(self) -> None:
        while True:
            await self.do(self.conversation.tick(self._clock.now_ns()))
            await asyncio.sleep(TICK_S)

    def _share(self, action: Publish) -> None:
        admission = self.conversation.admission
        if admission is not None:
            self._publish(admission, action.topic, action.message)

    def _finish(self, *, oversize: bool = False) -> None:
        if self._gone:
            return
        self._gone = True
        for action in self.conversation.lost(self._clock.now_ns(), oversize=oversize):
            if isinstance(action, Publish) and not (self.replaced and action.topic == "status"):
                self._share(action)
        self._left(self)
