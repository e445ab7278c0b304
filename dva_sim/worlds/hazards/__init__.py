"""Hazards as fields: fire and smoke, leaking gas, rising water; detectors and doses.

A kind of hazard is one class, shipped or in a file of the user; nothing outside its module asks
of which kind one is. It may import sites, maps and messages' words, no agents. Begin with
`hazard.py`, what all of them are, and `flood.py`, the simplest of them.
"""

from __future__ import annotations

from dva_sim.worlds.hazards.building import Building, SitePoints, building_of
from dva_sim.worlds.hazards.conditions import CLEAR, QUANTITIES, Conditions
from dva_sim.worlds.hazards.dose import Dose, pace_in_smoke, pace_in_water
from dva_sim.worlds.hazards.fire import GROWTH_S, Fire
from dva_sim.worlds.hazards.flood import Flood
from dva_sim.worlds.hazards.gas_leak import GASES, GasLeak
from dva_sim.worlds.hazards.hazard import Hazard, HazardField, detection_time, first_detection
from dva_sim.worlds.hazards.registry import KINDS, find_hazard, make_hazard
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
