"""Connections of a port: bounded in number, and the least important one makes room for a newcomer.

Anybody can open a connection, so one on which no token was shown never keeps out another: it is cut
after a few seconds, and sooner if all places are taken. Newcomers then take turns at a bounded
rate, so each has time to show its token, over a slow network too. Connections with a token yield to
those with a token of a higher rank. Pure: without a clock and without sockets.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field

_LOG = logging.getLogger("uvicorn.error")  # log of the server
MAX_CONNECTIONS = 512  # maximum connections of a port
MAX_SERVED = 400  # maximum connections with a token and a request; the rest are for newcomers
NEWCOMERS = 500  # design: rate at which newcomers may displace others without a token [1/s]
SILENT = 5.0  # time after which a connection without a token is cut [s]
IDLE = 20.0  # the same with a token, between requests [s]; longer than the server's own time-out


@dataclass(eq=False)
class PortConnection:
    """One connection.

    Attributes:
        places: The connections that it is one of.
        made: Time at which it was made [s].
        since: The same, or the time at which its newest request began or ended [s].
        rank: Rank of the role that its newest request showed; 0: no token.
        busy: True while a request is in progress or a WebSocket is open.
        drop: Cuts the connection.
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
        """Note a request: False if it has to be refused, as too many are in progress.

        Args:
            rank: Rank of the role that the request shows; 0: no token.
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
        self.places.taken.pop(self, None)


class PortConnections:
    """The connections of a port.

    Args:
        most: Connections at once.
        most_served: Connections at once with a token and a request in progress.

    Attributes:
        taken: The connections, in the order in which they were made.
        dropped: Number of connections that were cut, by the reason.
    """

    def __init__(self, most: int = MAX_CONNECTIONS, most_served: int = MAX_SERVED) -> None:
        self._most = most
        self._most_served = most_served
        self._turn = most / NEWCOMERS
        self.taken: dict[PortConnection, None] = {}
        self.dropped = {"silent": 0, "for a newcomer": 0, "for a higher rank": 0}

    def wait(self, now: float) -> float:
        """Return how long a newcomer waits for a place: so that each has its turn [s]."""
        if len(self.taken) < self._most:
            return 0.0
        least = self._least()
        return 0.0 if least.rank else max(0.0, least.made + self._turn - now)

    def enter(self, now: float) -> PortConnection:
        """Return the place of a new connection; if all are taken, another connection is cut."""
        if len(self.taken) >= self._most:
            self._drop(self._least(), "for a newcomer")
        slot = PortConnection(self, now, now)
        self.taken[slot] = None
        return slot

    def bear(self, slot: PortConnection) -> bool:
        """Return whether a request may be served; a lower rank's connection may be cut for it."""
        served = [each for each in self.taken if each.is_served]
        if len(served) <= self._most_served:
            return True
        least = min(served, key=_importance)
        if least.rank >= slot.rank:
            return False
        self._drop(least, "for a higher rank")
        return True

    def sweep(self, now: float) -> None:
        """Cut the connections that have been silent for too long."""
        for slot in list(self.taken):
            if not slot.is_served and now - slot.since > (IDLE if slot.rank else SILENT):
                self._drop(slot, "silent")

    def _least(self) -> PortConnection:
        """Return the connection that makes room first."""
        shaken = [slot for slot in self.taken if slot.rank > 0]
        # Newcomers show their token in their first request, so some places are always theirs.
        full = shaken if len(shaken) > self._most_served else ()
        return min(full or self.taken, key=_importance)

    def _drop(self, slot: PortConnection, why: str) -> None:
        slot.leave()
        self.dropped[why] += 1
        try:
            slot.drop()
        except Exception:  # one connection that cannot be cut must not keep the others
            _LOG.exception("a connection could not be cut")


def _importance(slot: PortConnection) -> tuple[bool, int, float]:
    """Return a sort key: requests with a token matter most, then the rank, then the newest.

    Without a token no request makes a connection newer: it would keep its place for ever.
    """
    return slot.is_served, slot.rank, slot.since if slot.rank else slot.made
