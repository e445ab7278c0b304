"""A viewer for Foxglove's server: its subprotocol over `websockets`, and nothing of ours.

References:
    https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md
"""

import contextlib
import json
import threading
from collections import deque

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

MESSAGE_DATA, TIME = 1, 2


class Viewer:
    """Subscribes to channels by topic as soon as they are advertised.

    Args:
        url: Address of the server.
        wants: Topics that are subscribed to.
        keeps: Number of messages that are kept of each topic; None: all.

    Attributes:
        channels: All that were advertised, by topic.
        came: Time [ns] and content of each message, by topic.
        times: Times of the server [ns].
    """

    def __init__(self, url: str, wants=lambda topic: True, keeps: int | None = None) -> None:
        self.channels, self.came, self.times, self.info = {}, {}, [], {}
        self._keeps = keeps
        self._wants, self._topics = wants, {}
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(url,), daemon=True)
        self._thread.start()

    def _run(self, url: str) -> None:
        with connect(url, subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
            self._socket = socket
            with contextlib.suppress(ConnectionClosed):
                for data in socket:
                    if isinstance(data, str):
                        self._take(json.loads(data))
                    elif data[0] == MESSAGE_DATA:
                        topic = self._topics[int.from_bytes(data[1:5], "little")]
                        time = int.from_bytes(data[5:13], "little")
                        came = self.came.setdefault(topic, deque(maxlen=self._keeps))
                        came.append((time, data[13:]))
                    elif data[0] == TIME:
                        self.times.append(int.from_bytes(data[1:9], "little"))

    def _take(self, message: dict) -> None:
        if message["op"] == "serverInfo":
            self.info = message
        for channel in message.get("channels", ()) if message["op"] == "advertise" else ():
            self.channels[channel["topic"]] = channel
            if self._wants(channel["topic"]):
                self._subscribe(channel)

    def _subscribe(self, channel: dict) -> None:
        number = len(self._topics) + 1
        self._topics[number] = channel["topic"]
        wish = {"id": number, "channelId": channel["id"]}
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": [wish]}))

    def of(self, topic: str) -> list[dict]:
        return [json.loads(data) for _, data in self.came.get(topic, [])]

    def leave(self) -> None:
        self._socket.close()
        self._thread.join()
