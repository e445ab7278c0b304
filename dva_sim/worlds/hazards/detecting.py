"""Who notices a hazard first, and when."""

from __future__ import annotations

import math

from dva_sim.worlds.hazards.base import DETECTS, Hazard
from dva_sim.worlds.site import Detector, Site

SPREAD = 0.05  # [m^2/s]
DOOR_DELAY = 30.0  # [s]


def detection_time(hazard: Hazard, detector: Detector, site: Site) -> float:
    """When a detector notices a hazard [s]; infinite if it never does."""
    gap = math.dist(hazard.position, (detector.x, detector.y))
    same = site.room_at(*hazard.position) == site.room_at(detector.x, detector.y)
    return hazard.start + gap * gap / (4.0 * SPREAD) + (0.0 if same else DOOR_DELAY)


def first_detection(kind: str, hazard: Hazard, site: Site) -> tuple[Detector | None, float]:
    """The detector that notices a hazard first, and when [s]; None and infinity if none does."""
    best: tuple[Detector | None, float] = None, math.inf
    for detector in site.detectors:
        if detector.kind == DETECTS[kind]:
            when = detection_time(hazard, detector, site)
            if when < best[1]:
                best = detector, when
    return best
