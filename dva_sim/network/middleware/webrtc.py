"""WebRTC data channels by aiortc, as browsers and phones have them: SCTP over DTLS over UDP.

The two ends agree over a TCP connection of their own, which is closed before anything is measured.
"""

from __future__ import annotations

import asyncio
import json
import time
from typing import TYPE_CHECKING, Final

from typing_extensions import override

from dva_sim.network.middleware.ends import (
    CommandTransport,
    Receive,
    Rendezvous,
    TransportEnd,
    TransportError,
    connected,
)
from dva_sim.network.middleware.event_loop import LoopEnd

if TYPE_CHECKING:
    from aiortc import RTCDataChannel, RTCPeerConnection

MAX_WAITING: Final = 1_000_000  # bytes that may wait in the program before nothing more is taken


class WebRtcTransport(CommandTransport):
    """A WebRTC data channel.

    Args:
        ordered: True if messages arrive in the order in which they were sent.
        retransmits: Number of times a lost message is sent again; None: until it arrives.
    """

    title = "WebRTC"
    library = "aiortc"
    extra = "webrtc"

    def __init__(self, ordered: bool = True, retransmits: int | None = None) -> None:
        self.ordered = ordered
        self.retransmits = retransmits

    @override
    def near(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        end = _Near(receive)
        return connected(end, lambda: end.connect(self, place))

    @override
    def far(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        return _Far(place, receive)


class _WebRtcEnd(LoopEnd):
    def __init__(self, receive: Receive) -> None:
        from aiortc import RTCConfiguration, RTCPeerConnection

        super().__init__()
        self._receive = receive
        self._channel: RTCDataChannel | None = None

        async def make() -> RTCPeerConnection:
            return RTCPeerConnection(RTCConfiguration(iceServers=[]))

        self._peer = self.run(make())

    def _take(self, channel: RTCDataChannel) -> None:
        channel.on("message", self._hear)
        self._channel = channel

    def _hear(self, data: bytes | str) -> None:
        self._receive(data if isinstance(data, bytes) else data.encode())

    @override
    def send(self, data: bytes) -> bool:
        channel = self._channel
        if channel is None or channel.readyState != "open":
            return False
        if channel.bufferedAmount > MAX_WAITING:
            return False
        self.soon(channel.send, data)
        return True

    @override
    def close(self) -> None:
        self.finish(self._peer.close())
        super().close()


class _Near(_WebRtcEnd):
    def connect(self, options: WebRtcTransport, place: Rendezvous) -> None:
        """Agree with the robot's end, and wait until the channel is open."""
        reader, writer = self.reach(
            lambda: asyncio.open_connection(place.far, place.port), place.ready_by
        )
        try:
            limit = place.ready_by - time.monotonic()
            self.run(asyncio.wait_for(self._agree(options, reader, writer), limit))
        except TimeoutError:
            raise TransportError("no data channel was opened") from None

    async def _agree(
        self, options: WebRtcTransport, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        channel = self._peer.createDataChannel(
            "commands", ordered=options.ordered, maxRetransmits=options.retransmits
        )
        is_open = asyncio.Event()
        channel.on("open", is_open.set)
        await self._peer.setLocalDescription(await self._peer.createOffer())
        writer.write(_line(self._peer))
        await self._peer.setRemoteDescription(_description(await reader.readline()))
        writer.close()
        await is_open.wait()
        self._take(channel)


class _Far(_WebRtcEnd):
    def __init__(self, place: Rendezvous, receive: Receive) -> None:
        super().__init__(receive)
        self._peer.on("datachannel", self._take)
        self._server = self.run(asyncio.start_server(self._agree, place.far, place.port))

    @override
    def close(self) -> None:
        self._server.close()
        super().close()

    async def _agree(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await self._peer.setRemoteDescription(_description(await reader.readline()))
        await self._peer.setLocalDescription(await self._peer.createAnswer())
        writer.write(_line(self._peer))
        await writer.drain()
        writer.close()


def _line(peer: RTCPeerConnection) -> bytes:
    values = {"sdp": peer.localDescription.sdp, "type": peer.localDescription.type}
    return json.dumps(values).encode() + b"\n"


def _description(line: bytes) -> object:
    from aiortc import RTCSessionDescription

    return RTCSessionDescription(**json.loads(line))
