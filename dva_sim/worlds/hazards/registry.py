"""Hazards by the name of their kind, as scenarios give it.

The field of a hazard, whatever its kind.
"""

from __future__ import annotations

import math
from dataclasses import fields

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import hint, unknown
from dva_sim.worlds.hazards.building import Building
from dva_sim.worlds.hazards.field import Hazard, Point
from dva_sim.worlds.hazards.fire import GROWTH_S, Fire, largest_peak
from dva_sim.worlds.hazards.fire_field import FireField
from dva_sim.worlds.hazards.flood import Flood, FloodField
from dva_sim.worlds.hazards.gas_dispersion import CLASSES
from dva_sim.worlds.hazards.gas_leak import GASES, GasLeak
from dva_sim.worlds.hazards.gas_leak_field import LeakField
from dva_sim.worlds.line_of_sight import Sight

KINDS: dict[str, type[Fire] | type[GasLeak] | type[Flood]] = {
    "fire": Fire,
    "gas_leak": GasLeak,
    "flood": Flood,
}
CHOICES = {"growth": tuple(GROWTH_S), "gas": tuple(GASES), "stability": tuple(CLASSES)}
LARGEST = {  # assumed; beyond any building, and beyond what the fields are made for
    "peak": 100e3,  # [kW]
    "inflow": 10.0,  # [m^3/s]
    "rate": 10.0,  # [m^3/s]
    "draught": 100.0,  # [m^3/s]
    "wind": 50.0,  # [m/s]
}
ANY_SIGN = ("wind_heading", "supply_x", "supply_y", "exhaust_x", "exhaust_y")


def make_hazard(kind: str, position: Point, start: float, **settings: str | float) -> Hazard:
    """A hazard at a place [m], from `start` [s] on.

    Args:
        kind: `fire`, `gas_leak` or `flood`.
        position: Its middle [m].
        start: [s]
        settings: What else belongs to its kind: `growth`, `gas`, `rate`, `inflow`, ...

    Raises:
        ConfigError: a kind or setting that is not known, or a number that is not positive or
            absurdly large, or a fire without the fuel to grow to its peak.
    """
    if kind not in KINDS:
        raise ConfigError(unknown("hazard", kind, KINDS))
    known = [field.name for field in fields(KINDS[kind]) if field.name not in ("position", "start")]
    for name, value in settings.items():
        if name not in known:
            problem = f"a {kind} has no setting {name!r}"
            raise ConfigError(f"{problem}; {hint(name, known, 'it has')}")
        _check(kind, name, value)
    hazard = KINDS[kind](position, start, **settings)  # type: ignore[arg-type]
    if isinstance(hazard, Fire) and hazard.peak > largest_peak(hazard.growth):
        most = f"its fuel lasts to {largest_peak(hazard.growth):.0f}"
        raise ConfigError(f"peak {hazard.peak:g} kW of a {hazard.growth} fire is too large: {most}")
    return hazard


def _check(kind: str, name: str, value: str | float) -> None:
    """One setting of a kind."""
    choices = CHOICES.get(name)
    if choices is not None:
        if value not in choices:
            raise ConfigError(unknown(name, value, choices))
    elif name in ANY_SIGN and isinstance(value, int | float) and math.isfinite(value):
        return
    elif not isinstance(value, int | float) or not 0.0 < value < math.inf:
        raise ConfigError(f"{name} of a {kind} is a positive number, not {value!r}")
    elif value > LARGEST.get(name, math.inf):
        raise ConfigError(f"{name} of a {kind} is at most {LARGEST[name]:g}, not {value:g}")


Field = FireField | LeakField | FloodField


def field_of(hazard: Hazard, building: Building, sight: Sight) -> Field:
    """The field of a hazard."""
    if isinstance(hazard, Fire):
        return FireField(building, sight, hazard)
    if isinstance(hazard, GasLeak):
        return LeakField(building, hazard)
    assert isinstance(hazard, Flood)
    return FloodField(building, hazard)
