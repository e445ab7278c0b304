"""Hazards as fields: fire and smoke, leaking gas, rising water; detectors and doses."""

from __future__ import annotations

from dva_sim.worlds.hazards.detectors import DETECTS, detection_time, first_detection
from dva_sim.worlds.hazards.dose import Dose, pace_in_smoke, pace_in_water, visibility
from dva_sim.worlds.hazards.field import CLEAR, Conditions, Hazard
from dva_sim.worlds.hazards.fire import GROWTH_S, Fire
from dva_sim.worlds.hazards.flood import Flood
from dva_sim.worlds.hazards.gas_leak import GASES, GasLeak
from dva_sim.worlds.hazards.registry import KINDS, make_hazard
from dva_sim.worlds.hazards.surroundings import Raster, Surroundings

__all__ = [
    "CLEAR",
    "DETECTS",
    "GASES",
    "GROWTH_S",
    "KINDS",
    "Conditions",
    "Dose",
    "Fire",
    "Flood",
    "GasLeak",
    "Hazard",
    "Raster",
    "Surroundings",
    "detection_time",
    "first_detection",
    "make_hazard",
    "pace_in_smoke",
    "pace_in_water",
    "visibility",
]
