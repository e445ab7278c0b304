"""What both ends of an exchange keep: growing MessageIDs, and replies already given."""

from __future__ import annotations

from collections import OrderedDict

from dva_sim.protocol.codec import encode, timestamp
from dva_sim.protocol.messages import Body, Heartbeat, Message


class Outbox:
    """Puts headers on what a device says.

    Args:
        source: Id of the device.
        start_of_day: Time of day at which the run starts [s since midnight].
    """

    def __init__(self, source: str, start_of_day: float = 43_200.0) -> None:
        self.source = source
        self._start = start_of_day
        self._last_id = 0

    def message(self, destination: str, body: Body, now: float, session: int = 0) -> Message:
        """A message that is newer than all before it."""
        self._last_id += 1
        held = None if isinstance(body, Heartbeat) else session
        stamp = timestamp(self._start + now)
        return Message(destination, self._last_id, self.source, stamp, held, body)

    def encode(self, destination: str, body: Body, now: float, session: int = 0) -> bytes:
        """The same as bytes."""
        return encode(self.message(destination, body, now, session))

    @staticmethod
    def encoded(message: Message) -> bytes:
        """The bytes of a message made here."""
        return encode(message)


class ReplyCache:
    """Replies already given, so that a request sent again acts once.

    A request is known by its bytes and by whose key it came: what an impostor was told is not
    for the one it played. A device that starts anew counts its MessageIDs from 1
    again, and must not be given the answers of its former life.

    Args:
        size: How many are kept; the oldest are forgotten first.
    """

    def __init__(self, size: int = 256) -> None:
        self._size = size
        self._replies: OrderedDict[tuple[str | None, bytes], bytes] = OrderedDict()

    def get(self, sender: str | None, request: bytes) -> bytes | None:
        """The reply to the same request, if it was answered before."""
        return self._replies.get((sender, request))

    def put(self, sender: str | None, request: bytes, reply: bytes) -> bytes:
        """Remember a reply and return it."""
        self._replies[sender, request] = reply
        if len(self._replies) > self._size:
            self._replies.popitem(last=False)
        return reply
