"""Which detector of a site notices a hazard first, and when."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from dva_sim.worlds.hazards.alarms import LATEST
from dva_sim.worlds.hazards.hazard import Hazard
from dva_sim.worlds.layout import Site
from dva_sim.worlds.site_parts import Detector


def detection_time(hazard: Hazard, detector: Detector, site: Site) -> float:
    """When a detector notices a hazard [s]; infinite if it does not within an hour."""
    return _first(hazard, [detector] if detector.kind in hazard.noticed_by() else [], site)[1]


def first_detection(hazard: Hazard, site: Site) -> tuple[Detector | None, float]:
    """The detector that notices a hazard first, and when [s]; None and infinity if none does."""
    return _first(hazard, [d for d in site.detectors if d.kind in hazard.noticed_by()], site)


def _first(
    hazard: Hazard, detectors: Sequence[Detector], site: Site
) -> tuple[Detector | None, float]:
    """All detectors are asked at growing ages until one sounds."""
    best: tuple[Detector | None, float] = None, math.inf
    if not detectors:
        return best
    field = hazard.model_copy(update={"start": 0.0}).field(site)
    alarms = [(d, field.alarm(d.kind, d.x, d.y)) for d in detectors]
    best = min(((d, alarm.at_latest) for d, alarm in alarms), key=lambda found: found[1])
    for age, dt in _ages():
        if age >= best[1]:
            break
        sounding = [d for d, alarm in alarms if alarm.sounds(age, dt) and age >= alarm.reached]
        if sounding:
            best = sounding[0], age
            break
    return (best[0], hazard.start + best[1]) if best[1] < math.inf else (None, math.inf)


def _ages() -> Iterator[tuple[float, float]]:
    """Ages at which alarms are asked, and the time since the last one [s]: 2 % apart."""
    age = 0.0
    while age < LATEST:
        dt = float(max(1, round(0.02 * age)))
        age += dt
        yield age, dt
