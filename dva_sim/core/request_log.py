"""The log of requests to the DVA: the newest are kept while a control room asks for them.

Requests are logged as they arrived, readable or not. A session is shown without its random half:
readers can tell sessions apart, and act in none of them.
"""

from __future__ import annotations

import re
from base64 import b64encode
from collections import deque
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Final

from dva_sim.protocol import limits
from dva_sim.protocol import messages as m
from dva_sim.protocol.exchange import LOW_BITS
from dva_sim.protocol.wire_size import LIST_BYTES, sent_time, xml_size

MAX_LOGGED: Final = 256  # maximum requests that are kept
MAX_LISTED: Final = 32  # maximum requests in one answer
KEPT_FOR: Final = 60.0  # requests are kept this long after somebody asked, like a `DevSub` [s]
SHOWN_BYTES: Final = 4096  # maximum bytes shown of a request, and of its reply if both fit [B]
ENTRY_BYTES: Final = 300  # maximum size of an entry without its shown bytes and text [B]
_NAMES: Final = "|".join(
    sorted(name for name in limits.names() if limits.types_of(name) & {"Session", "SessionID"})
)
MAX_DIGITS: Final = 20  # maximum decimal digits of a 64-bit session
_DIGIT: Final = re.compile(rb"\d")
_SESSION: Final = re.compile(rf"(<(?:{_NAMES})\s*>)([^<]*)".encode())


@dataclass(frozen=True, slots=True, kw_only=True)
class KeptRequest:
    """A request and its answer.

    Attributes:
        number: Number in the order of arrival, from 1.
        arrived: Arrival time [s].
        size: Size of the request [B].
        data: Its first bytes.
        service_time: Time until the answer [s]; None: there was none.
        reply: The answer, if there was one.
        answer: Its bytes.
    """

    number: int
    arrived: float
    size: int
    data: bytes
    service_time: float | None = None
    reply: m.Reply | None = None
    answer: bytes = b""


@dataclass
class KeptRequests:
    """The newest requests, and the number of all.

    Attributes:
        newest: Number of the newest request.
    """

    newest: int = 0
    _wanted_until: float = -1.0
    _kept: deque[KeptRequest] = field(default_factory=lambda: deque(maxlen=MAX_LOGGED))

    def count(self) -> int:
        """Return the number of a request that has just arrived."""
        self.newest += 1
        return self.newest

    def is_wanted(self, now: float) -> bool:
        """Return True if somebody has asked for requests lately."""
        return now < self._wanted_until

    def want(self, now: float) -> None:
        """Keep requests for a while: somebody asks for them, or is about to."""
        self._wanted_until = now + KEPT_FOR

    def keep(self, request: KeptRequest) -> None:
        """Keep a request; the oldest makes room."""
        self._kept.append(request)

    def above(self, number: int, now: float) -> m.RequestLog:
        """Return the requests above a number, as many as fit into a message, and keep more."""
        self.want(now)
        listed = list[m.LoggedRequest]()
        room = LIST_BYTES
        newer = (request for request in self._kept if request.number > number)
        for request in islice(newer, MAX_LISTED):
            entry = _entry(request, now)
            room -= ENTRY_BYTES + _size(entry) + len(entry.reply or "")
            if listed and room < 0:
                break
            listed.append(entry)
        return m.RequestLog(self.newest, tuple(listed))


def _entry(request: KeptRequest, now: float) -> m.LoggedRequest:
    reply = request.reply
    took = request.service_time
    entry = m.LoggedRequest(
        request_number=request.number,
        ago=sent_time(now - request.arrived),
        size=request.size,
        request=_shown(request.data),
        service_time=None if took is None else sent_time(took),
        code=None if reply is None else reply.code,
        text=None if reply is None else reply.text or None,
    )
    # Base64 turns three bytes into four characters.
    room = max(0, LIST_BYTES - ENTRY_BYTES - _size(entry)) // 4 * 3
    return replace(entry, reply=_shown(request.answer, room) or None)


def _size(entry: m.LoggedRequest) -> int:
    return len(entry.request) + xml_size(entry.text or "")


def _shown(data: bytes, room: int = SHOWN_BYTES) -> str:
    return b64encode(without_sessions(data)[: min(room, SHOWN_BYTES)]).decode()


def without_sessions(data: bytes) -> bytes:
    """Return a message whose sessions end in zeros in place of their random half."""
    return _SESSION.sub(lambda match: match[1] + _public_half(match[2]), data)


def _public_half(session: bytes) -> bytes:
    if session.isdigit() and len(session) <= MAX_DIGITS:
        return str(int(session) >> LOW_BITS << LOW_BITS).encode()
    return _DIGIT.sub(b"0", session)  # still as malformed as it arrived
