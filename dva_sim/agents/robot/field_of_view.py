"""Field of view of a robot's camera: visible hazards, and visibility in smoke.

References:
    Contrast falls with the optical depth as exp(-depth): H. Koschmieder, 1924.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

from dva_sim.agents.observation import CLEAR, SEEN_THROUGH, Point, SeenHazard, no_smoke
from dva_sim.agents.route_following import wrap
from dva_sim.kernel.makers import maker


class HazardSpot(NamedTuple):
    """Hazard as the camera may see it: kind, place and radius [m].

    Attributes:
        shines: True if it is visible through smoke.
    """

    kind: str
    x: float
    y: float
    radius: float
    shines: bool = False


make_spot = maker(HazardSpot)


OPAQUE_DEPTH_M = 0.5  # depth of smoke right before the camera, which hides everything beyond [m]


@dataclass(frozen=True)
class FieldOfView:
    """Field of view and range of a camera.

    Attributes:
        angle: Whole angle of view [rad].
        range: Distance at which a hazard can be recognised [m].
        line_of_sight: Predicate: True if no wall stands between two places.
        smoke: Optical depth of the smoke between two places now.
        hazy: Predicate: True if smoke impairs anybody's sight now; if not, `smoke` is zero
            everywhere.
    """

    angle: float
    range: float
    line_of_sight: Callable[[Point, Point], bool]
    smoke: Callable[[Point, Point], float] = no_smoke
    hazy: Callable[[], bool] = lambda: True

    def look(
        self, x: float, y: float, heading: float, hazards: Iterable[HazardSpot]
    ) -> tuple[SeenHazard, ...]:
        """Return the hazards in a picture taken from a pose [m, rad]."""
        sights = []
        for hazard in hazards:
            dx = hazard.x - x
            dy = hazard.y - y
            distance = math.hypot(dx, dy)
            if distance - hazard.radius > self.range:
                continue
            bearing = wrap(math.atan2(dy, dx) - heading)
            half_width = math.atan2(hazard.radius, distance)
            if abs(bearing) - half_width > self.angle / 2:
                continue
            here = (x, y)
            place = (hazard.x, hazard.y)
            if not self.line_of_sight(here, place):
                continue
            depth = 0.0 if hazard.shines else self.smoke(here, place)
            if depth < SEEN_THROUGH:
                looks = 2.0 * half_width, math.exp(-depth)
                sights.append(SeenHazard(hazard.kind, hazard.x, hazard.y, distance, *looks))
        return tuple(sights)

    def visibility(self, x: float, y: float, heading: float) -> float:
        """Return how far things that do not glow are visible from a pose [m, rad]; at most `CLEAR`.

        It depends on the thicker of the smoke right before the camera and that along its axis:
        clear air beyond a wall does not help to see through the smoke before it.
        """
        if not self.hazy():
            return CLEAR
        ahead = math.cos(heading), math.sin(heading)
        thickest = max(
            self.smoke((x, y), (x + far * ahead[0], y + far * ahead[1])) / far
            for far in (OPAQUE_DEPTH_M, self.range)
        )
        return min(SEEN_THROUGH / thickest, CLEAR) if thickest > 0.0 else CLEAR
