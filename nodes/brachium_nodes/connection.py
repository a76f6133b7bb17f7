"""One node's WebSocket at the gateway: moves bytes and time between the socket and the conversation."""

from collections.abc import Callable

from brachium_nodes.conversation import Action, Close, Conversation, Publish, Send
from brachium_nodes.node_socket import NodeSocket
from brachium_nodes.roster import Admission
from brachium_wire.hosttime import HostClock
from brachium_wire.messages import Message


class Connection:
    """Drives one conversation until either side ends it.

    `publish(admission, topic, message)` must not block; `left(connection)` is called once, when the node is
    gone or another connection took its place.
    """

    def __init__(
        self,
        socket: NodeSocket,
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
        socket.message, socket.closed = self._receive, self._closed

    def tick(self, now_s: float) -> None:
        """Do what time asks for, when the conversation is due; `now_s`: the event loop's time."""
        self._socket.keep_alive(now_s)
        self.do(self.conversation.tick(self._clock.now_ns()))

    def do(self, actions: list[Action]) -> None:
        """Carry out what the conversation asks for. A peer that is gone is no error here."""
        for action in actions:
            if isinstance(action, Publish):
                if self.conversation.admission is not None:
                    self._publish(self.conversation.admission, action.topic, action.message)
            elif isinstance(action, Send):
                self._socket.send(action.frame)
            else:
                assert isinstance(action, Close)
                self._finish()  # before the close: who waits for it finds the counts final
                self._socket.close(action.code, action.reason)

    def _receive(self, payload: bytes | str) -> None:
        self.do(self.conversation.receive(payload, self._clock.now_ns()))

    def _closed(self, oversize: bool) -> None:
        self._finish(oversize=oversize)

    def _finish(self, *, oversize: bool = False) -> None:
        if self._gone:
            return
        self._gone = True
        for action in self.conversation.lost(self._clock.now_ns(), oversize=oversize):
            if not (self.replaced and isinstance(action, Publish) and action.topic == "status"):
                self.do([action])
        self._left(self)
