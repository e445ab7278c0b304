"""State of both ends of an exchange: growing MessageIDs, and replies already given."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Hashable
from enum import Enum
from hashlib import blake2b

from dva_sim.protocol.codec import encode, timestamp
from dva_sim.protocol.messages import Body, Heartbeat, Message, make_message

NOON = 43_200.0  # start of a run in virtual time [s since midnight]
LOW_BITS = 32  # random bits of a session, so that nobody can guess it; the bits above only grow
A_DAY = 345_600  # sessions in a day, at most four a second


def is_absurd(session: int, highest: int) -> bool:
    """Return True for a session number that no honest DVA can have reached by now.

    It is more than a day ahead of the highest known one, or leaves no room for another day.
    Without a known session (0) only the latter can be checked.
    """
    count = session >> LOW_BITS
    newest = (1 << LOW_BITS) - 1
    return count > newest - A_DAY or (bool(highest) and count > (highest >> LOW_BITS) + A_DAY)


class Outbox:
    """Headers and numbers for the messages of a device.

    Args:
        source: Id of the device.
        start_of_day: Time of day at which the run starts [s since midnight].
        exact: True for timestamps in microseconds. In real time they distinguish the messages of a
            device from those before its restart, which have the same numbers.
    """

    def __init__(self, source: str, start_of_day: float = NOON, exact: bool = False) -> None:
        self.source = source
        self._start = start_of_day
        self._exact = exact
        self._last_id = 0

    def set_clock(self, by: float) -> None:
        """Set the wall clock of its timestamps forward by a time [s]."""
        self._start += by

    def message(self, destination: str, body: Body, now: float, session: int = 0) -> Message:
        """Return a message that is newer than all before it."""
        self._last_id += 1
        session_id = None if isinstance(body, Heartbeat) else session
        stamp = timestamp(self._start + now, self._exact)
        return make_message(destination, self._last_id, self.source, stamp, session_id, body)

    def encode(self, destination: str, body: Body, now: float, session: int = 0) -> bytes:
        """Serialise a new message."""
        return encode(self.message(destination, body, now, session))


Key = tuple[str | None, bytes]


def key_of(sender: str | None, request: bytes) -> Key:
    """Return the identity of a request: the key it came with, if keys are used, and its bytes."""
    return sender, blake2b(request, digest_size=16).digest()


class _Kept:
    """Replies to one source: their keys, and their total size [B]."""

    __slots__ = ("keys", "used")

    def __init__(self) -> None:
        self.keys = deque[Key]()
        self.used = 0


class ReplyCache:
    """Replies already given, so that a repeated request acts only once.

    A request is recognised by its bytes and the key it came with: a reply to an impostor is not
    for the device it imitated. A device that restarts counts its MessageIDs from 1 again, and must
    not get the replies to its earlier requests.

    Args:
        each: Maximum number of replies kept per source. The oldest are dropped first, so that no
            source can displace another's replies.
        sources: Maximum number of sources; those silent longest are dropped first.
        room: Maximum size of the replies kept per source, without the last one [B].
    """

    def __init__(self, each: int = 64, sources: int = 1024, room: int = 65_536) -> None:
        self._each = each
        self._sources = sources
        self._room = room
        self._replies: dict[Key, bytes] = {}
        self._kept: OrderedDict[str, _Kept] = OrderedDict()

    def get(self, key: Key) -> bytes | None:
        """Return the reply to the same request, if it was answered before."""
        return self._replies.get(key)

    def put(self, key: Key, source: str, reply: bytes) -> bytes:
        """Remember a reply to a request of `source`, and return it."""
        replies = self._kept.get(source)
        if replies is None:
            replies = self._kept[source] = _Kept()
        self._kept.move_to_end(source)
        keys = replies.keys
        used = replies.used + len(reply)
        keys.append(key)
        self._replies[key] = reply
        while len(keys) > self._each or (used > self._room and len(keys) > 1):
            used -= len(self._replies.pop(keys.popleft(), b""))
        replies.used = used
        if len(self._kept) > self._sources:
            for key in self._kept.popitem(last=False)[1].keys:
                self._replies.pop(key, None)
        return reply


class Hearing(Enum):
    """Treatment of a peer: answered, read but not answered, or not even read."""

    ANSWERED = "answered"
    READ = "read"
    IGNORED = "ignored"


ANSWERED, READ, IGNORED = Hearing  # globals: looking a member up is slow


class Nuisances:
    """Peers whose messages are refused on arrival, and who are increasingly ignored; pure.

    Each connection has a count of its bad messages, which falls with time and is halved by each
    good message. Above `UNANSWERED` the connection gets no more replies to bad messages; above
    `UNREAD` only possible emergencies are read, until it has been quiet for a while. What it sends
    meanwhile is counted as refused.
    """

    UNANSWERED = 20.0  # count up to which bad messages get a reply, for programs that err
    UNREAD = 100.0  # count above which messages are not read
    MOST = 200.0  # highest count: a peer that stops is read again 10 s later
    FORGIVEN = 10.0  # decrease of the count per second [1/s]
    PEERS = 1000  # maximum number of peers; those silent longest are dropped first

    def __init__(self) -> None:
        self._counts: OrderedDict[Hashable, tuple[float, float]] = OrderedDict()

    def hearing(self, peer: Hashable, now: float) -> Hearing:
        """Return how messages of a peer are treated now [s]."""
        if not self._counts:
            return ANSWERED
        count = self._count(peer, now)
        if count > self.UNREAD:
            return IGNORED
        return READ if count > self.UNANSWERED else ANSWERED

    def bad(self, peer: Hashable, now: float) -> None:
        """Note that it has sent an invalid message."""
        self._counts[peer] = min(self.MOST, self._count(peer, now) + 1.0), now
        self._counts.move_to_end(peer)
        if len(self._counts) > self.PEERS:
            self._counts.popitem(last=False)

    def good(self, peer: Hashable, now: float) -> None:
        """Note that it has sent a message."""
        if peer in self._counts:
            count = self._count(peer, now) / 2
            if count < 1.0:
                del self._counts[peer]
            else:
                self._counts[peer] = count, now

    def _count(self, peer: Hashable, now: float) -> float:
        count, when = self._counts.get(peer, (0.0, now))
        return max(0.0, count - self.FORGIVEN * (now - when))
