"""A server for Foxglove: what a recording would hold, while the run goes on.

The server is that of Foxglove's SDK, which sends from threads of its own and takes nothing from
its clients. It knows no tokens, so it listens on this machine alone.
"""

from __future__ import annotations

import json
import logging
import threading
import urllib.request
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from dva_sim.kernel.errors import ConfigError
from dva_sim.live.running_channels import RunningChannels
from dva_sim.recordings import channels
from dva_sim.recordings.messages import XML, ChannelMessage, nanoseconds
from dva_sim.recordings.writing import schema_of_channel
from dva_sim.simulation.scenario import Scenario

LAYOUT: Final = Path(channels.__file__).with_name("foxglove_layout.json")  # panels of a run
LOCALHOST: Final = "127.0.0.1"
MISSING: Final = "--foxglove needs Foxglove's SDK: pip install 'dva-sim[foxglove]'"
BACKLOG: Final = 4096  # messages that wait for a client; then its oldest ones are dropped
LOOK: Final = 0.5  # between two looks at which cameras are watched [s]
STREAM_WITHIN: Final = 5.0  # for a picture to come [s]
LARGEST: Final = 2_000_000  # of a picture [B]


class FoxgloveServer:
    """Serves one run.

    Args:
        seed: Random seed.
        port: To listen on; 0 for any that is free.

    Attributes:
        camera_base: URL below which the robots' pictures are; empty: nowhere.
        camera_token: Shown there; empty: none.
        failures: Lines that could not be shown.

    Raises:
        ConfigError: the SDK is not installed, or the port is taken.
    """

    def __init__(self, scenario: Scenario, seed: int, port: int) -> None:
        try:
            import foxglove  # late: start-up
        except ImportError:
            raise ConfigError(MISSING) from None
        logging.getLogger("foxglove").setLevel(logging.ERROR)
        self._sdk: Any = foxglove
        self._running = RunningChannels(scenario, seed)
        self._lock, self._is_over = threading.Lock(), threading.Event()
        self._context = foxglove.Context()
        self._channels: dict[str, Any] = {}
        self._viewed: dict[str, threading.Thread] = {}
        self.camera_base, self.camera_token, self.failures = "", "", 0
        try:
            self._server = foxglove.start_server(
                name="dva-sim",
                host=LOCALHOST,
                port=port,
                capabilities=[foxglove.Capability.Time],
                server_listener=self._listener(),
                context=self._context,
                message_backlog_size=BACKLOG,
            )
        except (OSError, RuntimeError, ValueError) as error:
            text = f"cannot listen on {LOCALHOST} port {port}: {error}"
            raise ConfigError(f"{text}; give another --foxglove, or --foxglove 0") from None
        threading.Thread(target=self._look_at_cameras, daemon=True).start()

    @property
    def url(self) -> str:
        """Return the address that Foxglove opens."""
        return f"ws://{LOCALHOST}:{self._server.port}"

    @property
    def where(self) -> str:
        """Return a line that says where it is, and where a layout for it."""
        return f"Foxglove: {self.url} (layout: {LAYOUT})"

    def _listener(self) -> Any:
        """Return a listener that tells late viewers of the scene what is there."""
        server = self

        class Listener(self._sdk.ServerListener):  # type: ignore[misc,name-defined]
            def on_subscribe(self, _: Any, channel: Any) -> None:
                if channel.topic == channels.TOPIC:
                    server.tell_scene()

        return Listener()

    def tell_scene(self) -> None:
        """Say again what stands on the site."""
        with self._lock:
            self._log(self._running.standing())

    def keep(self, lines: bytes) -> None:
        """Take whole lines of the run's parts; any thread may."""
        with self._lock:
            before = self._running.now
            for line in lines.splitlines():
                # These lines are judged by the safety rules as well, by the thread that calls.
                try:
                    self._take(json.loads(line))
                except (ValueError, LookupError, TypeError):
                    self.failures += 1
            if self._running.now != before and not self._is_over.is_set():
                self._server.broadcast_time(nanoseconds(self._running.now))

    def _take(self, line: list[Any]) -> None:
        if line[0] == "cameras":
            self.camera_base = line[1]
        else:
            self._log(self._running.take(line))

    def _log(self, messages: Iterable[ChannelMessage]) -> None:
        for message in messages:
            if not self._is_over.is_set():
                channel = self._channel(message.topic, message.schema)
                if channel.has_sinks():
                    channel.log(message.content, log_time=nanoseconds(message.time))

    def _channel(self, topic: str, schema: str) -> Any:
        """A channel, which is advertised with its first message."""
        known = self._channels.get(topic)
        if known is None:
            name, encoding, text = schema_of_channel(schema)
            form = self._sdk.Schema(name=name, encoding=encoding, data=text)
            known = self._sdk.Channel(
                topic,
                schema=form,
                message_encoding=XML if schema == XML else "json",
                context=self._context,
            )
            self._channels[topic] = known
        return known

    # --- pictures ------------------------------------------------------------------------

    def _look_at_cameras(self) -> None:
        """Read the pictures of the robots whose channel somebody has subscribed to."""
        while not self._is_over.wait(LOOK):
            with self._lock:
                robots = self._running.robots if self.camera_base else []
                found = [(name, self._image(name)) for name in robots]
            for name, channel in found:
                reader = self._viewed.get(name)
                if channel.has_sinks() and (reader is None or not reader.is_alive()):
                    reader = threading.Thread(target=self._read, args=(name,), daemon=True)
                    self._viewed[name] = reader
                    reader.start()

    def _image(self, name: str) -> Any:
        return self._channel(f"/{name}/{channels.IMAGE}", "foxglove.CompressedImage")

    def _read(self, name: str) -> None:
        """Pass on the pictures of a robot as long as somebody looks."""
        query = f"?token={self.camera_token}" if self.camera_token else ""
        url = f"{self.camera_base}camera/{name}.mjpg{query}"
        with suppress(OSError, ValueError), urllib.request.urlopen(url, timeout=STREAM_WITHIN) as s:
            while not self._is_over.is_set() and self._image(name).has_sinks():
                length, captured = _head(s)
                picture = channels.picture(captured, name, s.read(length))
                with self._lock:
                    self._log([picture])

    def close(self) -> None:
        """Serve no longer."""
        with self._lock:
            self._is_over.set()
        self._server.stop()


def _head(stream: Any) -> tuple[int, float]:
    """Read the headers of a part: bytes of the picture, and when it was captured [s].

    Raises:
        ValueError: there is none, or it is too large.
    """
    length, captured = 0, 0.0
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
