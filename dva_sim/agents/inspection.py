"""Looking at the place of an event: from where, which way, and for how long."""

from __future__ import annotations

import math
from collections.abc import Callable

from dva_sim.agents.camera import SeenHazard
from dva_sim.agents.manoeuvres import FACING, STAND, Seen, turn_to
from dva_sim.agents.operator.strategies import Intent
from dva_sim.agents.steering import wrap

Point = tuple[float, float]

IN_VIEW = "in view"  # so ends what a robot says while it looks at a place
LOOK_FROM = 4.0  # an event in view no farther than this is looked at from here [m]; assumed
KEEP_OFF = 1.2  # from here the place is looked at, whatever is in view [m]
MATCH_WITHIN = 4.0  # a hazard so near the place is the one to look at [m]
FIRST_LOOK = 3.0  # with nothing in view for so long, it looks all around [s]; assumed
LOOK_AROUND = 0.4  # turn rate meanwhile [rad/s]; assumed
INSPECT_FOR = 120.0  # an inspection that nobody ends is done after this [s]; assumed


class Inspection:
    """Looks at one place.

    Args:
        event: Kind of the event.
        place: Where it is said to be [m].
        sees: Whether nothing stands between two places.
        most_turn: Highest turn rate [rad/s].
    """

    def __init__(
        self,
        event: str,
        place: Point,
        sees: Callable[[Point, Point], bool],
        most_turn: float,
    ) -> None:
        self._event, self._place, self._sees, self._most = event, place, sees, most_turn
        self._since = self._nothing_since = math.inf
        self._turned, self._heading = 0.0, 0.0

    def begins(self, seen: Seen) -> bool:
        """Whether the robot is where it can look from; from then on it is."""
        if self._since == math.inf and self._is_at_view(seen):
            self._since = seen.now
        return self._since < math.inf

    def is_over(self, seen: Seen) -> bool:
        """Whether it has looked for long enough."""
        return seen.now - self._since > INSPECT_FOR

    def finding(self, seen: Seen) -> str:
        """What is in view, in words."""
        what = self._event.replace("_", " ") if self._in_view(seen) else "nothing"
        return f"{what} {IN_VIEW}"

    def step(self, seen: Seen) -> Intent:
        """Face the event; with nothing in view, first its place, then all around, once."""
        event = self._in_view(seen)
        if event is not None:
            self._nothing_since = math.inf
            return self._face(seen, (event.x, event.y))
        self._nothing_since = min(self._nothing_since, seen.now)
        if seen.now - self._nothing_since < FIRST_LOOK:
            self._heading = seen.view.heading
            return self._face(seen, self._place)
        self._turned += abs(seen.view.heading - self._heading)
        self._heading = seen.view.heading
        return STAND if self._turned > 2.0 * math.pi else Intent(0.0, LOOK_AROUND)

    def _is_at_view(self, seen: Seen) -> bool:
        event = self._in_view(seen)
        if event is not None and event.distance <= LOOK_FROM:
            return True
        near = math.dist(seen.here, self._place) < KEEP_OFF
        return near and self._sees(seen.here, self._place)

    def _in_view(self, seen: Seen) -> SeenHazard | None:
        """The event, if it is in the picture."""
        found = [
            h
            for h in seen.view.hazards
            if h.kind == self._event and math.dist((h.x, h.y), self._place) < MATCH_WITHIN
        ]
        return min(found, key=lambda h: h.distance, default=None)

    def _face(self, seen: Seen, place: Point) -> Intent:
        bearing = math.atan2(place[1] - seen.view.y, place[0] - seen.view.x)
        if abs(wrap(bearing - seen.view.heading)) < FACING:
            return STAND
        return turn_to(seen.view, bearing, self._most)
