"""A server for Foxglove that shows the channels of a recording during the run.

It has a thread with its own event loop, and accepts only subscriptions from its viewers. It listens
only on this machine.
"""

from __future__ import annotations

import asyncio
import json
import secrets
import threading
import urllib.request
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket

from dva_sim.live.foxglove_viewer import PROTOCOLS, FoxgloveViewer, ViewedChannel
from dva_sim.live.running_channels import RunningChannels
from dva_sim.recordings import channels
from dva_sim.recordings.messages import XML, ChannelMessage, nanoseconds
from dva_sim.recordings.writing import packed
from dva_sim.serving.open_port import OpenPort
from dva_sim.serving.port_connections import PortConnections
from dva_sim.serving.port_guard import PortGuard
from dva_sim.serving.server import Server, serve
from dva_sim.serving.web_sockets import WireProtocol, heard, say
from dva_sim.simulation.scenario import Scenario

LAYOUT: Final = Path(channels.__file__).with_name("foxglove_layout.json")  # panels of a run
PROGRAMS: Final = (
    "https://app.foxglove.dev",
    "file://",
)  # Foxglove in a browser, and as an application
MAX_REQUEST: Final = 100_000  # design: maximum size of a viewer's request [B]
MAX_CONNECTIONS = 64
MAX_VIEWERS = 16
PING: Final = 2.0  # design: interval between two pings [s]
PONG_WITHIN: Final = 3.0  # design: time for a reply before a viewer is cut [s]
ENDS_WITHIN: Final = 5.0  # design: time for the server's thread to end [s]
LOOK: Final = 0.5  # interval of checks which cameras are watched [s]
STREAM_WITHIN: Final = 5.0  # maximum wait for a picture [s]
LARGEST: Final = 2_000_000  # maximum size of a picture [B]


Shown = tuple[ViewedChannel, int, bytes]  # channel, time [ns] and content of a message


class FoxgloveServer:
    """Serves one run.

    Args:
        scenario: Scenario of the run.
        seed: Random seed.
        port: Port to serve.

    Attributes:
        camera_base: URL of the server of the robots' pictures; empty: none.
        camera_token: Token for that server; empty: none.
        failures: Number of lines that could not be shown.
    """

    def __init__(self, scenario: Scenario, seed: int, port: OpenPort) -> None:
        self._port = port
        self._running = RunningChannels(scenario, seed)
        self._lock = threading.Lock()
        self._is_over = threading.Event()
        self._channels: dict[str, ViewedChannel] = {}
        self._by_number: dict[int, ViewedChannel] = {}
        self._viewers: set[FoxgloveViewer] = set()
        self._session = secrets.token_hex(8)
        self._announced = 0
        self._read_by: dict[str, threading.Thread] = {}
        self.camera_base = ""
        self.camera_token = ""
        self.failures = 0
        self._loop = asyncio.new_event_loop()
        self._ended = asyncio.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()
        threading.Thread(target=self._look_at_cameras, daemon=True).start()

    @property
    def where(self) -> str:
        """Return a line with the server's address and the path of a layout."""
        return f"Foxglove: {self._port.url} (layout: {LAYOUT})"

    # --- viewers, in the thread of the event loop --------------------------------------------

    def _serve(self) -> None:
        app = Starlette(routes=[WebSocketRoute("/", self._view)])
        server = Server.of(
            PortGuard(app, self._port.admission(PROGRAMS)),
            MAX_REQUEST,
            ws=WireProtocol,
            ws_max_size=MAX_REQUEST,
            ws_ping_interval=PING,
            ws_ping_timeout=PONG_WITHIN,
            ws_per_message_deflate=False,
        )
        places = PortConnections(MAX_CONNECTIONS, MAX_VIEWERS)
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(serve(server, self._port.listener, places, self._ended))

    async def _view(self, ws: WebSocket) -> None:
        protocol = next((name for name in PROTOCOLS if name in ws.scope["subprotocols"]), None)
        if protocol is None:
            text = f"a viewer should offer the subprotocol {PROTOCOLS[0]}\n"
            await ws.send_denial_response(PlainTextResponse(text, 400))
            return
        await ws.accept(protocol)
        viewer = FoxgloveViewer(self._session)
        viewer.advertise(self._by_number.values())
        self._viewers.add(viewer)
        tasks = {asyncio.ensure_future(work(ws, viewer)) for work in (self._send, self._hear)}
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._viewers.discard(viewer)
            viewer.leave()
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    @staticmethod
    async def _send(ws: WebSocket, viewer: FoxgloveViewer) -> None:
        while await say(ws, await viewer.next()):
            pass

    async def _hear(self, ws: WebSocket, viewer: FoxgloveViewer) -> None:
        while (text := await heard(ws)) is not None:
            if channels.TOPIC in viewer.take(text, self._by_number):
                await asyncio.to_thread(self._tell_scene)

    def _show(self, new: list[ViewedChannel], messages: list[Shown], time: int | None) -> None:
        self._by_number |= {channel.number: channel for channel in new}
        for viewer in self._viewers:
            viewer.advertise(new)
            for channel, at, content in messages:
                viewer.show(channel, at, content)
            if time is not None:
                viewer.tell_time(time)

    # --- the run, in any thread --------------------------------------------------------------

    def _tell_scene(self) -> None:
        """Repeat the static scene, for a viewer that connects late."""
        with self._lock:
            self._log(self._running.standing())

    def keep(self, lines: bytes) -> None:
        """Show whole lines of the run's parts; may be called by any thread."""
        with self._lock:
            before = self._running.now
            messages = []
            for line in lines.splitlines():
                # The calling thread also judges these lines, so no error may escape.
                try:
                    messages += self._take(json.loads(line))
                except (ValueError, LookupError, TypeError):
                    self.failures += 1
            now = self._running.now
            self._log(messages, nanoseconds(now) if now != before else None)

    def _take(self, line: list[Any]) -> list[ChannelMessage]:
        if line[0] == "cameras":
            self.camera_base = line[1]
            return []
        return list(self._running.take(line))

    def _log(self, messages: Iterable[ChannelMessage], time: int | None = None) -> None:
        """Show new channels, messages to their subscribers, and the time [ns]."""
        entries = []
        for message in messages:
            channel = self._channel(message.topic, message.schema)
            if channel.viewers:
                at, _, _, content = packed(message)
                entries.append((channel, at, content))
        new = list(self._channels.values())[self._announced :]
        self._announced += len(new)
        if not self._is_over.is_set():
            self._loop.call_soon_threadsafe(self._show, new, entries, time)

    def _channel(self, topic: str, schema: str) -> ViewedChannel:
        """Return a channel; a new one is advertised with its first message."""
        channel = self._channels.get(topic)
        if channel is None:
            encoding = XML if schema == XML else "json"
            channel = ViewedChannel(len(self._channels) + 1, topic, schema, encoding)
            self._channels[topic] = channel
        return channel

    # --- pictures ------------------------------------------------------------------------

    def _look_at_cameras(self) -> None:
        """Start reading the pictures of each robot whose channel has a subscriber."""
        while not self._is_over.wait(LOOK):
            with self._lock:
                robots = self._running.robots if self.camera_base else []
                images = [(name, self._image(name)) for name in robots]
                self._log([])  # advertises the new channels
            for name, channel in images:
                reader = self._read_by.get(name)
                if channel.viewers and (reader is None or not reader.is_alive()):
                    reader = threading.Thread(target=self._read, args=(name,), daemon=True)
                    self._read_by[name] = reader
                    reader.start()

    def _image(self, name: str) -> ViewedChannel:
        return self._channel(f"/{name}/{channels.IMAGE}", "foxglove.CompressedImage")

    def _read(self, name: str) -> None:
        """Pass on the pictures of a robot while its channel has a subscriber."""
        query = f"?token={self.camera_token}" if self.camera_token else ""
        url = f"{self.camera_base}camera/{name}.mjpg{query}"
        with suppress(OSError, ValueError), urllib.request.urlopen(url, timeout=STREAM_WITHIN) as s:
            while not self._is_over.is_set() and self._image(name).viewers:
                length, captured = _head(s)
                picture = channels.picture(captured, name, s.read(length))
                with self._lock:
                    self._log([picture])

    def close(self) -> None:
        """End the server."""
        with self._lock:
            self._is_over.set()
            self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join(ENDS_WITHIN)


def _head(stream: Any) -> tuple[int, float]:
    """Read the headers of a part; return the size of the picture [B] and its capture time [s].

    Raises:
        ValueError: the picture is missing or too large.
    """
    length = 0
    captured = 0.0
    while line := stream.readline(1000):
        name, _, value = line.strip().lower().partition(b": ")
        if name == b"content-length":
            length = int(value)
        elif name == b"x-frame-time-ms":
            captured = int(value) / 1000
        elif not line.strip() and length:
            if length > LARGEST:
                break
            return length, captured
    raise ValueError("no picture")
