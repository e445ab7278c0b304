"""State of both ends of an exchange: growing MessageIDs, and replies already given."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Hashable
from enum import Enum
from hashlib import blake2b

from dva_sim.protocol.codec import encode, timestamp
from dva_sim.protocol.messages import Body, Heartbeat, Message, make_message

NOON = 43_200.0  # when a run in virtual time begins [s since midnight]
LOW_BITS = 32  # of a session: nobody can guess them; the bits above only grow
A_DAY = 345_600  # sessions: the DVA hands out at most four a second


def is_absurd(session: int, highest: int) -> bool:
    """Return True for a session number that no honest DVA can have reached by now.

    It is more than a day ahead of the highest that is known, or leaves no room for another day.
    Without any known session (0) the former cannot be checked.
    """
    count = session >> LOW_BITS
    newest = (1 << LOW_BITS) - 1
    return count > newest - A_DAY or (bool(highest) and count > (highest >> LOW_BITS) + A_DAY)


class Outbox:
    """Puts headers on what a device says.

    Args:
        source: Id of the device.
        start_of_day: Time of day at which the run starts [s since midnight].
        exact: Timestamps to the microsecond. In real time they have to tell the messages of a
            device from those of its former life, which are numbered alike.
    """

    def __init__(self, source: str, start_of_day: float = NOON, exact: bool = False) -> None:
        self.source = source
        self._start = start_of_day
        self._exact = exact
        self._last_id = 0

    def set_clock(self, by: float) -> None:
        """Set the clock on the wall that its timestamps show, by so many seconds [s]."""
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
    """The replies to one source: what they are known by, and how long they are in all [B]."""

    __slots__ = ("keys", "used")

    def __init__(self) -> None:
        self.keys = deque[Key]()
        self.used = 0


class ReplyCache:
    """Replies already given, so that a request sent again acts once.

    A request is known by its bytes and by whose key it came: a reply to an impostor is not
    for the one it played. A device that restarts counts its MessageIDs from 1
    again, and must not be given the answers of its former life.

    Args:
        each: Maximum number of replies kept per source. The oldest are forgotten first, so that no
            source can make another's be forgotten.
        sources: Maximum number of sources; those longest unheard of are forgotten first.
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


ANSWERED, READ, IGNORED = Hearing  # found faster than as members of their class


class Nuisances:
    """Peers whose messages are refused on arrival, and who are increasingly ignored; pure.

    Each connection has a count of its bad messages that goes down with time, and is halved by
    each good one. Above `UNANSWERED` nobody tells it any more what was wrong; above `UNREAD` it is
    not read, but for what may be an emergency, until it has been quiet for a while. What it sends
    meanwhile is counted like all that is refused.
    """

    UNANSWERED = 20.0  # bad messages; a program that errs is told of it
    UNREAD = 100.0
    MOST = 200.0  # the count goes no higher: who stops is read again 10 s later
    FORGIVEN = 10.0  # in a second
    PEERS = 1000  # those longest unheard of are forgotten first

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
