"""Places at which no detector notices an event: an assumed time decides when it is found."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.simulation.timed.travel import FOUND, Rooms, terrain_of


class Unnoticed(NamedTuple):
    """Number of places at which detectors miss a kind of event.

    Attributes:
        kind: Kind of event.
        places: Number of places at which no detector notices it within `FOUND`.
        of: Number of all places at which it may begin.
    """

    kind: str
    places: int
    of: int


def unnoticed(scenario: TimedScenario) -> Iterator[Unnoticed]:
    """Yield the kinds of event that detectors miss at some places.

    Raises:
        ConfigError: the site cannot be read.
    """
    streams = [stream for stream in scenario.demand if stream.notice == "detectors"]
    if not streams:
        return
    ground = terrain_of(scenario)
    assert isinstance(ground, Rooms)  # the scenario refuses detectors without a site
    for kind in dict.fromkeys(stream.kind for stream in streams):
        zone_names = [stream.zones or ground.zones for stream in streams if stream.kind == kind]
        zones = {ground.zones.index(name) for names in zone_names for name in names}
        places = [place for zone in sorted(zones) for place in ground.spots(zone)]
        hidden = sum(ground.detected_after(kind, place) >= FOUND for place in places)
        if hidden:
            yield Unnoticed(kind, hidden, len(places))
