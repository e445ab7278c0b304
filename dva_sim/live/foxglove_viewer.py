"""A viewer of Foxglove: its subscriptions, and the messages that wait for it.

References:
    https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md
"""

from __future__ import annotations

import asyncio
import json
import struct
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

from dva_sim.recordings.writing import schema_of_channel

PROTOCOLS: Final = (
    "foxglove.sdk.v1",
    "foxglove.websocket.v1",
)  # they differ only in parts not used here
MAX_WAITING: Final = (
    8_000_000  # design: maximum data waiting for a viewer; beyond, the oldest is dropped [B]
)
MESSAGE = 1  # kind of binary message: data of a channel
TIME = 2  # kind of binary message: time of the run
SERVER_INFO: Final = {"op": "serverInfo", "name": "dva-sim", "capabilities": ["time"]}


@dataclass(eq=False)
class ViewedChannel:
    """A channel that viewers may subscribe to.

    Attributes:
        number: Id of the channel.
        topic: Topic of the channel.
        schema: Name of its schema.
        encoding: Encoding of its messages.
        viewers: Number of viewers that have subscribed.
    """

    number: int
    topic: str
    schema: str
    encoding: str
    viewers: int = 0

    def advertised(self) -> dict[str, Any]:
        """Return the advertisement of the channel."""
        name, encoding, text = schema_of_channel(self.schema)
        return {
            "id": self.number,
            "topic": self.topic,
            "encoding": self.encoding,
            "schemaName": name,
            "schemaEncoding": encoding,
            "schema": text.decode(),
        }


class FoxgloveViewer:
    """A viewer, used only in the thread of the event loop.

    Args:
        session: Id of the run.
    """

    def __init__(self, session: str) -> None:
        self._subscriptions: dict[ViewedChannel, int] = {}
        self._texts: deque[str] = deque([json.dumps(SERVER_INFO | {"sessionId": session})])
        self._data: deque[bytes] = deque()
        self._waiting = 0
        self._news = asyncio.Event()

    def advertise(self, channels: Iterable[ViewedChannel]) -> None:
        """Announce channels."""
        if entries := [channel.advertised() for channel in channels]:
            self._texts.append(json.dumps({"op": "advertise", "channels": entries}))
            self._news.set()

    def show(self, channel: ViewedChannel, time: int, content: bytes) -> None:
        """Send a channel's message with its time [ns], if the viewer has subscribed to it."""
        number = self._subscriptions.get(channel)
        if number is not None:
            self._put(struct.pack("<BIQ", MESSAGE, number, time) + content)

    def tell_time(self, time: int) -> None:
        """Send the time of the run [ns]."""
        self._put(struct.pack("<BQ", TIME, time))

    def _put(self, data: bytes) -> None:
        self._data.append(data)
        self._waiting += len(data)
        while self._waiting > MAX_WAITING:
            self._waiting -= len(self._data.popleft())
        self._news.set()

    async def next(self) -> str | bytes:
        """Return the next message for the viewer; announcements come first."""
        while not self._texts and not self._data:
            self._news.clear()
            await self._news.wait()
        if self._texts:
            return self._texts.popleft()
        data = self._data.popleft()
        self._waiting -= len(data)
        return data

    def take(self, text: str | bytes, channels: dict[int, ViewedChannel]) -> set[str]:
        """Handle a request of the viewer.

        Args:
            text: The request; an invalid one is ignored.
            channels: All channels, by their numbers.

        Returns:
            Topics newly subscribed to by this request.
        """
        try:
            request = json.loads(text)
            if request["op"] == "unsubscribe":
                numbers = set(request["subscriptionIds"])
                self._leave([c for c, number in self._subscriptions.items() if number in numbers])
            if request["op"] != "subscribe":
                return set()
            wishes = [(int(w["id"]), int(w["channelId"])) for w in request["subscriptions"]]
        except (ValueError, LookupError, TypeError, RecursionError):
            return set()
        topics = set()
        for number, channel_number in wishes:
            channel = channels.get(channel_number)
            if channel is not None and 0 <= number < 1 << 32 and channel not in self._subscriptions:
                self._subscriptions[channel] = number
                channel.viewers += 1
                topics.add(channel.topic)
        return topics

    def _leave(self, channels: Iterable[ViewedChannel]) -> None:
        for channel in channels:
            del self._subscriptions[channel]
            channel.viewers -= 1

    def leave(self) -> None:
        """End all subscriptions."""
        self._leave(list(self._subscriptions))
