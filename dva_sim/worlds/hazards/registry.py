"""Hazards by name: the shipped kinds, a class in a file of the user, or an installed package's."""

from __future__ import annotations

from typing import Final, cast

from dva_sim.kernel.plugins import Plugins
from dva_sim.worlds.hazards.fire import Fire
from dva_sim.worlds.hazards.flood import Flood
from dva_sim.worlds.hazards.gas_leak import GasLeak
from dva_sim.worlds.hazards.hazard import Hazard, Point

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
    """The class that `kind` means.

    Args:
        kind: A shipped kind such as `fire`, a class in a file such as `mine.py:Mine`, or the
            name under which an installed package offers one (entry point, `dva_sim.hazards`).

    Raises:
        ConfigError: there is none of that name, or it cannot be loaded, or is no hazard.
    """
    return cast(type[Hazard], PLUGINS.find(kind))


def make_hazard(kind: str, position: Point, start: float, **settings: str | float) -> Hazard:
    """A hazard at a place [m], from `start` [s] on.

    Args:
        kind: See `find_hazard`.
        position: Its middle [m].
        start: [s]
        settings: What else belongs to its kind: `growth`, `gas`, `rate`, `inflow`, ...

    Raises:
        ConfigError: a kind or setting that is not known, or a value that it cannot have.
    """
    return PLUGINS.make(kind, find_hazard(kind), settings, position, start)
