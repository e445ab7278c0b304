"""Connections of a port: bounded in number; the least important one makes room for a newcomer.

Anybody can open a connection, so a connection without a token must not block others: it is cut
after a few seconds, or sooner if all slots are taken. Newcomers then displace each other at a
bounded rate, so that each has time to show its token even over a slow network. Connections with a
token yield to those whose token has a higher rank. Pure: no clock, no sockets.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field

_LOG = logging.getLogger("uvicorn.error")  # log of the server
MAX_CONNECTIONS = 512  # maximum connections of a port
MAX_SERVED = 400  # maximum connections with a request in progress; newcomers get the others
NEWCOMERS = 500  # design: rate at which newcomers may displace others without a token [1/s]
SILENT = 5.0  # time after which a connection without a token is cut [s]
IDLE = 20.0  # idle time with a token before a cut [s]; uvicorn's own time-out is shorter


@dataclass(eq=False)
class PortConnection:
    """One connection.

    Attributes:
        places: All connections of the port.
        made: Time at which it was made [s].
        since: Time of the last change [s]: made, or begin or end of its newest request.
        rank: Rank of the role of its newest request's token; 0: no token.
        busy: True while a request is in progress or a WebSocket is open.
        drop: Function that cuts the connection.
    """

    places: PortConnections = field(repr=False)
    made: float
    since: float
    rank: int = 0
    busy: bool = False
    drop: Callable[[], object] = field(default=lambda: None, repr=False)

    @property
    def is_served(self) -> bool:
        """True while a request with a token is in progress."""
        return self.busy and self.rank > 0

    def begin(self, rank: int, now: float, *, is_limited: bool = True) -> bool:
        """Note a request; return False if too many are in progress, so that it must be refused.

        Args:
            rank: Rank of the role of the request's token; 0: no token.
            now: Time [s].
            is_limited: False for requests outside the limit.
        """
        self.rank = rank
        self.busy = True
        self.since = now
        return not (is_limited and self.is_served) or self.places.bear(self)

    def end(self, now: float) -> None:
        """Note that the request is answered, or its WebSocket is closed."""
        self.busy = False
        self.since = now

    def leave(self) -> None:
        """Note that the connection is closed; may be repeated."""
        self.places.connections.pop(self, None)


class PortConnections:
    """The connections of a port.

    Args:
        most: Maximum number of connections.
        most_served: Maximum number of them with a token and a request in progress.

    Attributes:
        connections: The connections, in the order in which they were made.
        dropped: Number of connections that were cut, by reason.
    """

    def __init__(self, most: int = MAX_CONNECTIONS, most_served: int = MAX_SERVED) -> None:
        self._limit = most
        self._served_limit = most_served
        self._turn = most / NEWCOMERS
        self.connections: dict[PortConnection, None] = {}
        self.dropped = {"silent": 0, "for a newcomer": 0, "for a higher rank": 0}

    def wait(self, now: float) -> float:
        """Return the time until a newcomer may enter [s]; 0 while there is room."""
        if len(self.connections) < self._limit:
            return 0.0
        least = self._least()
        return 0.0 if least.rank else max(0.0, least.made + self._turn - now)

    def enter(self, now: float) -> PortConnection:
        """Return the slot of a new connection; cut another one if all are taken."""
        if len(self.connections) >= self._limit:
            self._drop(self._least(), "for a newcomer")
        slot = PortConnection(self, now, now)
        self.connections[slot] = None
        return slot

    def bear(self, slot: PortConnection) -> bool:
        """Return True if a request may be served; a connection of lower rank may be cut for it."""
        served = [each for each in self.connections if each.is_served]
        if len(served) <= self._served_limit:
            return True
        least = min(served, key=_importance)
        if least.rank >= slot.rank:
            return False
        self._drop(least, "for a higher rank")
        return True

    def sweep(self, now: float) -> None:
        """Cut the connections that have been silent for too long."""
        for slot in list(self.connections):
            if not slot.is_served and now - slot.since > (IDLE if slot.rank else SILENT):
                self._drop(slot, "silent")

    def _least(self) -> PortConnection:
        """Return the least important connection."""
        with_token = [slot for slot in self.connections if slot.rank > 0]
        # Newcomers show their token in their first request, so some slots are reserved for them.
        full = with_token if len(with_token) > self._served_limit else ()
        return min(full or self.connections, key=_importance)

    def _drop(self, slot: PortConnection, why: str) -> None:
        slot.leave()
        self.dropped[why] += 1
        try:
            slot.drop()
        except Exception:  # a failure to cut one connection must not protect the others
            _LOG.exception("a connection could not be cut")


def _importance(slot: PortConnection) -> tuple[bool, int, float]:
    """Return a sort key: requests with a token matter most, then rank, then recency.

    A request without a token does not make a connection more recent: repeating it would keep the
    slot for ever.
    """
    return slot.is_served, slot.rank, slot.since if slot.rank else slot.made
