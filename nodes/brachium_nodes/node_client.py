"""A node's side of the WebSocket: hello, answers to clock questions, frames, and a bye with its count."""

import asyncio
import logging
from collections.abc import Callable

import msgspec
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidStatus, InvalidURI

from brachium_nodes.kept_calibration import calibration_of
from brachium_nodes.node_frames import (
    MAX_FRAME_BYTES,
    Batch,
    Bye,
    ClockAnswer,
    ClockAsk,
    Hello,
    Keep,
    Kept,
    NodeStatus,
    RefusalCode,
    Refused,
    Welcome,
    from_gateway,
)
from brachium_wire.codec import WireError, encode
from brachium_wire.messages import SensorCalibration

log = logging.getLogger(__name__)

LEAVE_WITHIN_S = 2.0


class NoGateway(ConnectionError):
    """Nobody answers at the address, or somebody who is no gateway; trying again may help."""


class NotWelcome(RuntimeError):
    """The gateway refused the node; `code` is its reason in one word, "wrong_token" for HTTP 401."""

    def __init__(self, code: RefusalCode, reason: str, retry_s: float | None) -> None:
        super().__init__(reason)
        self.code, self.retry_s = code, retry_s


class NodeClient:
    """One connection of one node.

    `device_us` reads the node's clock; `store` puts a calibration where it survives that the node is switched
    off.
    """

    def __init__(
        self,
        url: str,
        token: str,
        hello: Hello,
        device_us: Callable[[], int],
        store: Callable[[SensorCalibration], None] = lambda _: None,
    ) -> None:
        self._url, self._token, self._hello, self._device_us = url, token, hello, device_us
        self._store = store
        self._socket: ClientConnection | None = None
        self._reader: asyncio.Task[None] | None = None
        self.refused: Refused | None = None
        """What the gateway said when it ended the connection."""

    async def join(self) -> Welcome:
        """Connect and be let in. Raises NoGateway or NotWelcome."""
        socket = await self._connect()
        try:
            await socket.send(encode(self._hello))
            answer = from_gateway(await socket.recv())
        except (ConnectionClosed, WireError) as error:
            await socket.close()
            raise NoGateway(f"{self._url} ended the conversation: {error}") from None
        if not isinstance(answer, Welcome):
            await socket.close()
            if isinstance(answer, Refused):
                raise NotWelcome(answer.code, answer.reason, answer.retry_s)
            raise NoGateway(f"{self._url} answered a hello with {type(answer).__name__}")
        self._socket, self.refused = socket, None
        self._reader = asyncio.create_task(self._listen(socket))
        return answer

    async def _connect(self) -> ClientConnection:
        try:
            return await connect(
                self._url,
                additional_headers={"Authorization": f"Bearer {self._token}"},
                compression=None,
                max_size=MAX_FRAME_BYTES,
                ping_interval=5,
                ping_timeout=10,
                open_timeout=3,
                close_timeout=1,
                proxy=None,
            )
        except InvalidStatus as error:
            if error.response.status_code == 401:
                text = f"{self._url} does not know the token of node {self._hello.node}"
                raise NotWelcome("wrong_token", text, None) from None
            raise NoGateway(f"{self._url} answers {error.response.status_code}; is it a gateway?") from None
        except InvalidURI:
            reason = f"{self._url!r} is no address of a gateway; write it as ws://127.0.0.1:8765/node"
            raise NotWelcome("bad_hello", reason, None) from None
        except (OSError, InvalidHandshake, TimeoutError) as error:
            raise NoGateway(f"no gateway at {self._url} ({error}); start one: brachium gateway") from None

    async def send(self, frame: Batch | NodeStatus) -> None:
        """Send a frame. Raises ConnectionError when the connection is gone."""
        await self.send_bytes(encode(frame))

    async def send_bytes(self, frame: bytes) -> None:
        """Send a frame as it is."""
        assert self._socket is not None
        try:
            await self._socket.send(frame)
        except ConnectionClosed as error:
            raise ConnectionError(str(error)) from None

    async def leave(self, next_sequence: int) -> None:
        """Say bye and wait until the gateway has counted and closed; nothing when not joined."""
        if self._socket is None:
            return
        try:
            await self.send_bytes(encode(Bye(next_sequence=next_sequence)))
            async with asyncio.timeout(LEAVE_WITHIN_S):
                await self.closed()
        except (ConnectionError, TimeoutError):
            pass
        await self.close()
        self._socket = None

    async def closed(self) -> int:
        """Wait until the connection is closed; return the close code."""
        assert self._socket is not None
        await self._socket.wait_closed()
        return self._socket.close_code or 1006

    async def close(self) -> None:
        """End the connection without a word."""
        if self._socket is not None:
            await self._socket.close()
        if self._reader is not None:
            await self._reader

    async def _listen(self, socket: ClientConnection) -> None:
        try:
            async for payload in socket:
                came_us = self._device_us()
                try:
                    frame = from_gateway(payload)
                except WireError:
                    continue
                if isinstance(frame, ClockAsk):
                    answer = ClockAnswer(id=frame.id, came_us=came_us, left_us=self._device_us())
                    await socket.send(encode(answer))
                elif isinstance(frame, Keep):
                    await self._keep(socket, frame)
                elif isinstance(frame, Refused):
                    self.refused = frame
        except ConnectionClosed:
            return

    async def _keep(self, socket: ClientConnection, frame: Keep) -> None:
        try:
            calibration = calibration_of(frame.calibration)
            self._store(calibration)
        except (WireError, OSError) as error:
            log.warning("node %s does not keep its calibration: %s", self._hello.node, error)
            return
        self._hello = msgspec.structs.replace(self._hello, calibration=calibration)
        await socket.send(encode(Kept()))
