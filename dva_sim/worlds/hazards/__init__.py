"""Hazards as fields: fire and smoke, leaking gas, rising water; detectors and doses.

A kind of hazard is one class, shipped or in a file of the user; nothing outside its module asks
of which kind one is. It may import sites, maps and messages' words, no agents. Begin with
`hazard.py`, what all of them are, and `flood.py`, the simplest of them.
"""

from __future__ import annotations

from typing import Final, cast

from dva_sim.kernel.plugins import Plugins
from dva_sim.worlds.hazards.building import Building, SitePoints, building_of
from dva_sim.worlds.hazards.conditions import CLEAR, QUANTITIES, Conditions
from dva_sim.worlds.hazards.dose import Dose, pace_in_smoke, pace_in_water
from dva_sim.worlds.hazards.fire import GROWTH_S, Fire
from dva_sim.worlds.hazards.flood import Flood
from dva_sim.worlds.hazards.gas_leak import GASES, GasLeak
from dva_sim.worlds.hazards.hazard import Hazard, HazardField, detection_time, first_detection
from dva_sim.worlds.hazards.surroundings import Raster, Surroundings

__all__ = [
    "CLEAR",
    "GASES",
    "GROWTH_S",
    "KINDS",
    "QUANTITIES",
    "Building",
    "Conditions",
    "Dose",
    "Fire",
    "Flood",
    "GasLeak",
    "Hazard",
    "HazardField",
    "Raster",
    "SitePoints",
    "Surroundings",
    "building_of",
    "detection_time",
    "find_hazard",
    "first_detection",
    "make_hazard",
    "pace_in_smoke",
    "pace_in_water",
]

KINDS: Final[dict[str, type[Hazard]]] = {kind.reported_as: kind for kind in (Fire, GasLeak, Flood)}
"""The shipped kinds: there is one for each that messages know."""

PLUGINS: Final = Plugins[Hazard](
    "hazard",
    Hazard,
    KINDS,
    folder="worlds/hazards",
    group="dva_sim.hazards",
    key="events.0.kind",
    needs="field(site)",
    public="dva_sim.worlds.hazards.Hazard",
)


def find_hazard(kind: str) -> type[Hazard]:
    """Return the class that `kind` means.

    Args:
        kind: A shipped kind such as `fire`, a class in a file such as `mine.py:Mine`, or the
            name under which an installed package offers one (entry point, `dva_sim.hazards`).

    Raises:
        ConfigError: there is none of that name, or it cannot be loaded, or is not a hazard.
    """
    return cast(type[Hazard], PLUGINS.find(kind))


def make_hazard(
    kind: str, position: tuple[float, float], start: float, **settings: str | float
) -> Hazard:
    """Return a hazard at a place [m], from `start` [s] on.

    Args:
        kind: See `find_hazard`.
        position: Its middle [m].
        start: [s]
        settings: Parameters of its kind: `growth`, `gas`, `rate`, `inflow`, ...

    Raises:
        ConfigError: a kind or setting that is not known, or a value that it cannot have.
    """
    return PLUGINS.make(kind, find_hazard(kind), settings, position, start)
