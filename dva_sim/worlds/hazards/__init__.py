"""Hazards as fields: fire and smoke, leaking gas, rising water; detectors and doses."""

from __future__ import annotations

from dva_sim.worlds.hazards.base import CLEAR, DETECTS, Conditions, Hazard
from dva_sim.worlds.hazards.detecting import detection_time, first_detection
from dva_sim.worlds.hazards.fire import GROWTH_S, Fire
from dva_sim.worlds.hazards.flood import Flood
from dva_sim.worlds.hazards.leak import GASES, GasLeak
from dva_sim.worlds.hazards.making import KINDS, make_hazard
from dva_sim.worlds.hazards.surroundings import Raster, Surroundings

__all__ = [
    "CLEAR",
    "DETECTS",
    "GASES",
    "GROWTH_S",
    "KINDS",
    "Conditions",
    "Fire",
    "Flood",
    "GasLeak",
    "Hazard",
    "Raster",
    "Surroundings",
    "detection_time",
    "first_detection",
    "make_hazard",
]
