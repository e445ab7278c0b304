"""Auctions: invited devices, their bids, and the end of the bidding."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dva_sim.core.events import Event, EventTable, State


@dataclass
class RunningAuction:
    """One task on offer.

    Attributes:
        until: End of the bidding [s].
        asked: Devices that may still bid; none after the end.
        arrival: Expected arrival of each bidder [s].
    """

    until: float
    asked: set[str]
    arrival: dict[str, float] = field(default_factory=dict)


@dataclass
class Auctions:
    """All auctions under way, by number of the event.

    Attributes:
        bid_within: Time for which bids are taken [s].
    """

    bid_within: float
    running: dict[int, RunningAuction] = field(default_factory=dict)

    def announce(self, event: int, bidders: Sequence[str], now: float) -> float:
        """Begin an auction; return the time for which bids are taken [s]."""
        self.running[event] = RunningAuction(now + self.bid_within, set(bidders))
        return self.bid_within

    def bid(self, event: int, device: str, arrival_in: float, now: float) -> bool:
        """Take a bid; False if it was not asked for, or comes too late."""
        auction = self.running.get(event)
        if auction is None or now > auction.until or device not in auction.asked:
            return False
        auction.asked.discard(device)
        auction.arrival[device] = now + arrival_in
        return True

    def no_bid(self, event: int, device: str) -> None:
        """Note that a device declines to bid, or cannot be reached."""
        auction = self.running.get(event)
        if auction is not None:
            auction.asked.discard(device)

    def close(self, events: EventTable, now: float) -> None:
        """Drop auctions of events that no longer wait, and end the bidding where the time is up."""
        for number, auction in list(self.running.items()):
            event = events.open.get(number)
            if event is None or event.state is not State.PENDING:
                del self.running[number]
            elif now >= auction.until:
                auction.asked.clear()

    def forget_useless(self, idle: Collection[str]) -> None:
        """Forget auctions that are over without a bid from anybody who is still idle."""
        for number, auction in list(self.running.items()):
            if not auction.asked and auction.arrival.keys().isdisjoint(idle):
                del self.running[number]

    def stage(self, event: int) -> Literal["open", "over"] | None:
        """Return the stage of a task's auction; None if it is not auctioned."""
        auction = self.running.get(event)
        if auction is None:
            return None
        return "open" if auction.asked else "over"

    def award(self, event: int, device: str) -> bool:
        """End an auction; return True if the device had bid in it."""
        auction = self.running.pop(event, None)
        return auction is not None and device in auction.arrival

    def bids(
        self, events: Sequence[Event], devices: Sequence[str], now: float
    ) -> NDArray[np.float64]:
        """Return offered arrivals [s from now], shape `(events, devices)`; NaN without a bid."""
        table = np.full((len(events), len(devices)), np.nan)
        for row, event in enumerate(events):
            auction = self.running.get(event.number)
            for column, device in enumerate(devices if auction and auction.arrival else ()):
                assert auction is not None
                table[row, column] = auction.arrival.get(device, math.nan) - now
        return table

    def next_deadline(self) -> float:
        """Return when the next auction closes [s]."""
        return min((a.until for a in self.running.values() if a.asked), default=math.inf)
