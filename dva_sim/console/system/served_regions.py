"""Regions of a site, and the DVA that serves each, as the DVAs themselves say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from dva_sim.console.wire.rows import RegionShown, RegionState
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.stage import dvas_of
from dva_sim.simulation.scenario import Scenario

ALARM_AFTER: Final = 5.0  # without a word, two statuses long, a DVA's silence is an alarm [s]


@dataclass
class ServedRegions:
    """Regions as one hears of them.

    Attributes:
        own: Id of each region's own DVA, by the name of the region.
        labels: Labels of the DVAs, by id.
        heard: Newest status of each DVA, by id, and its time [s].
    """

    own: Mapping[str, str]
    labels: Mapping[str, str]
    heard: dict[str, tuple[float, m.PeerStatus]] = field(default_factory=dict)

    def rows(self, now: float) -> list[RegionShown]:
        """Return each region as it is served at a time [s]; at the start all DVAs are there."""
        there = {d for d in self.labels if now - self.heard.get(d, (0.0,))[0] <= ALARM_AFTER}
        return [self._row(region, there) for region in self.own]

    def server_of(self, region: str) -> str:
        """Return the id of the DVA with the newest claim to a region."""
        claims = (
            (each.epoch, dva)
            for dva, (_, status) in self.heard.items()
            for each in status.regions
            if each.region == region
        )
        return max(claims, default=(1, self.own[region]))[1]

    def _row(self, region: str, there: set[str]) -> RegionShown:
        own = self.own[region]
        dva = self.server_of(region)
        how = "is back, and may get it back" if own in there else "is silent"
        state: RegionState = "served" if dva == own else "deputy"
        state = state if dva in there else "dead"
        text = {
            "served": f"served by {self.labels[dva]}",
            "deputy": f"served by {self.labels[dva]}, its deputy, as {self.labels[own]} {how}",
            "dead": f"{self.labels[dva]} is silent: nobody serves it",
        }
        is_returnable = state == "deputy" and own in there
        return {
            "name": region,
            "state": state,
            "text": text[state],
            "is_returnable": is_returnable,
        }


def regions_of(scenario: Scenario) -> ServedRegions:
    """Return the regions of a scenario, none for one DVA; nothing is heard of them yet."""
    dvas = dvas_of(scenario)
    return ServedRegions(dict(zip(scenario.dva.regions, dvas, strict=False)), dvas)
