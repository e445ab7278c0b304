"""Division of a site into regions, and the DVAs that serve them, as one DVA knows it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from dva_sim.core.registry import Registry
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import PEER

FIRST_EPOCH: Final = 1


class Claim(NamedTuple):
    """Service of a region: number of the DVAs that have served it so far, and the present one."""

    epoch: int
    dva: str


@dataclass
class Division:
    """Regions of a site, and the claims of the DVAs to them.

    Attributes:
        own: Id of the DVA that knows this.
        lines: DVAs that serve each region in turn, its own first, by the name of the region.
        region_at: Function that returns the region of a place.
        outside: Function that returns how far a place is outside a region [m].
        life: Number that tells this start of the DVA from others; it is part of event numbers.
        claims: Highest claim to each region that is known.
        forgotten: Regions that a DVA had taken over and, started again, knows nothing of.
    """

    own: str
    lines: Mapping[str, tuple[str, ...]]
    region_at: Callable[[m.Position], str]
    outside: Callable[[str, m.Position], float]
    life: int = 0
    claims: dict[str, Claim] = field(default_factory=dict)
    forgotten: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        for region, dvas in self.lines.items():
            self.claims.setdefault(region, Claim(FIRST_EPOCH, dvas[0]))

    @property
    def peers(self) -> tuple[str, ...]:
        """Ids of all other DVAs, those of its own region's line first."""
        return tuple(dva for dva in self.lines[self.home] if dva != self.own)

    @property
    def home(self) -> str:
        """Name of the region that is this DVA's own, served by it or by another."""
        return next(region for region, dvas in self.lines.items() if dvas[0] == self.own)

    def served(self) -> Iterator[tuple[str, int]]:
        """Yield the regions that this DVA serves, with their epochs."""
        return ((r, claim.epoch) for r, claim in self.claims.items() if claim.dva == self.own)

    def dva_at(self, place: m.Position) -> str:
        """Return the id of the DVA that serves a place."""
        return self.claims[self.region_at(place)].dva

    def other_at(self, place: m.Position, registry: Registry) -> str | None:
        """Return the other DVA that serves a place and is there, or None."""
        region = self.region_at(place)
        dva = self.claims[region].dva
        serves = dva != self.own and region not in self.forgotten
        return dva if serves and self.is_there(dva, registry) else None

    def learn(self, region: str, claim: Claim) -> bool:
        """Note a claim; True if it is higher than the one that was known.

        Of two claims of one epoch that of the DVA earlier in the line holds.
        """
        newest = self.claims.get(region)
        if newest is None or claim.dva not in self.lines[region]:
            return False
        if claim.epoch >= newest.epoch:
            self.forgotten.discard(region)
        rank = self.lines[region].index
        is_higher = (claim.epoch, -rank(claim.dva)) > (newest.epoch, -rank(newest.dva))
        if is_higher:
            self.claims[region] = claim
        return is_higher

    def deputy_of(self, region: str, registry: Registry) -> str | None:
        """Return the first in the line that is there and does not serve it; None if nobody is."""
        serves = self.claims[region].dva
        candidates = (d for d in self.lines[region] if d != serves and self.is_there(d, registry))
        return next(candidates, None)

    def is_there(self, dva: str, registry: Registry) -> bool:
        """Return True for this DVA, and for others that are heard."""
        entry = registry.entries.get(dva)
        return dva == self.own or (entry is not None and entry.kind == PEER and not entry.silent)
