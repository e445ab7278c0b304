"""The field of a hazard, whatever its kind."""

from __future__ import annotations

from dva_sim.worlds.hazards.base import Hazard
from dva_sim.worlds.hazards.building import Building
from dva_sim.worlds.hazards.fire import Fire
from dva_sim.worlds.hazards.fire_field import FireField
from dva_sim.worlds.hazards.flood import Flood
from dva_sim.worlds.hazards.flood_field import FloodField
from dva_sim.worlds.hazards.leak import GasLeak
from dva_sim.worlds.hazards.leak_field import LeakField
from dva_sim.worlds.sight import Sight

Field = FireField | LeakField | FloodField


def field_of(hazard: Hazard, building: Building, sight: Sight) -> Field:
    """The field of a hazard."""
    if isinstance(hazard, Fire):
        return FireField(building, sight, hazard)
    if isinstance(hazard, GasLeak):
        return LeakField(building, hazard)
    assert isinstance(hazard, Flood)
    return FloodField(building, hazard)
