"""Seats and their clients: pure, without a clock and without sockets.

A client that takes control gets a seat, and keeps it until it gives it up or is gone. What it
wants must come again and again while it holds on: a silent person's robot is stopped. A seat is
manned while its client is there; free seats are manned by open pages that have none.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from dva_sim.console.wire.limits import SILENT_AFTER

MAX_SEATS = 16
FIRST_OF_PHONES = 1000  # number of the seat of the first phone; the console's own are below
RELOADED = 3.0  # design: a page that is loaded again is open again by then, real time [s]


@dataclass
class TakenSeat:
    """A seat in which somebody sits.

    Attributes:
        number: Number of the seat, from 0.
        heard: Time of its newest input, real time [s].
        holds: True if that input asked for motion, or for standing while held.
    """

    number: int
    heard: float = 0.0
    holds: bool = False


class Seats:
    """Assignment of clients to seats.

    Attributes:
        taken: By client.
    """

    def __init__(self) -> None:
        self.taken: dict[str, TakenSeat] = {}
        self._there: dict[str, float] = {}  # until when, real time [s]
        self._may_drive: frozenset[str] = frozenset()

    def note_open(self, pages: Mapping[str, str], now: float) -> None:
        """Note which clients are there at a time [s], each with the role of its page, if any."""
        left = self._there.keys() - pages.keys()
        self._there |= {client: min(self._there[client], now + RELOADED) for client in left}
        self._there |= dict.fromkeys(pages, math.inf)
        self._may_drive |= {client for client, role in pages.items() if role}

    def manned(self, seats: Iterable[int], now: float) -> set[int]:
        """Return which of some seats are manned at a time [s]."""
        self._there = {client: until for client, until in self._there.items() if until > now}
        self._may_drive &= self._there.keys()
        used = {seat.number for seat in self.taken.values()}
        waiting = len(self._may_drive - self.taken.keys())
        free = sorted(set(seats) - used)[:waiting]
        here = {seat.number for client, seat in self.taken.items() if client in self._there}
        return here.union(free)

    def sit(self, client: str, rather: int | None = None) -> int | None:
        """Return the number of the seat of a client: its own, `rather`, or the lowest that is free.

        None: there is none.
        """
        if client in self.taken:
            return self.taken[client].number
        used = {seat.number for seat in self.taken.values()}
        free = next(
            (n for n in (rather, *range(MAX_SEATS)) if n is not None and n not in used), None
        )
        if free is not None:
            self.sit_at(client, free)
        return free

    def sit_at(self, client: str, number: int) -> None:
        """Let a client take a seat that is its own."""
        self.taken[client] = TakenSeat(number)
        self._there.setdefault(client, math.inf)

    def stand_up(self, client: str) -> int | None:
        """Let a client leave; return the seat it had."""
        seat = self.taken.pop(client, None)
        return None if seat is None else seat.number

    def heard(self, client: str, now: float, holds: bool) -> bool:
        """Take an input at a time [s]; return False if its sender sits nowhere."""
        seat = self.taken.get(client)
        if seat is None:
            return False
        seat.heard = now
        seat.holds = holds
        return True

    def silent(self, now: float) -> list[str]:
        """Return clients that held a control and have since been silent; each is reported once."""
        late = [
            client
            for client, seat in self.taken.items()
            if seat.holds and now - seat.heard > SILENT_AFTER
        ]
        for client in late:
            self.taken[client].holds = False
        return late
