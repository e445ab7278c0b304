"""What an operator makes of the pictures from the place of an event, whoever drives the robot."""

from __future__ import annotations

import math
from collections.abc import Callable

from dva_sim.agents.camera import Observation
from dva_sim.worlds.planning import Planner

SEARCH_FOR = 25.0  # looking around at the place for so long, a person says there is nothing [s]
AT_PLACE = 1.5  # nearer than this one is at the place [m]
MATCH_WITHIN = 4.0  # a hazard so near the reported place is the one reported [m]


class Looking:
    """Looks for one event: in view for long enough it is confirmed, not to be found it is refuted.

    Args:
        kind: Of the event.
        place: Where it is said to be [m].
        planner: The person knows the building.
        confirm_look: How long it must stay in view to be sure [s].
        arrived: Called once, when the event or its place is before the robot.
    """

    def __init__(
        self,
        kind: str,
        place: tuple[float, float],
        planner: Planner,
        confirm_look: float,
        arrived: Callable[[], object],
    ) -> None:
        self._kind, self._place, self._planner = kind, place, planner
        self._confirm_look, self._tell_arrived = confirm_look, arrived
        self._in_view_since: float | None = None
        self._at_place_since: float | None = None
        self._arrived = False

    def look(self, now: float, seen: Observation) -> tuple[str, str] | None:
        """A picture is perceived at `now` [s]: the outcome and why, once there is one."""
        return self._look_for_event(now, seen) or self._search(now, seen)

    def has_place_before_it(self, seen: Observation, within: float) -> bool:
        """Whether the place is near [m], and by the map no wall stands between."""
        here = seen.x, seen.y
        near = math.dist(here, self._place) < within
        return near and self._planner.line_of_sight(here, self._place)

    def _look_for_event(self, now: float, seen: Observation) -> tuple[str, str] | None:
        """An event that has been in view for long enough is confirmed."""
        if not any(self._is_the_event(h.kind, h.x, h.y) for h in seen.hazards):
            self._in_view_since = None
            return None
        if self._in_view_since is None:
            self._in_view_since = now
            self._arrive()
        elif now - self._in_view_since >= self._confirm_look:
            return "confirmed", ""
        return None

    def _is_the_event(self, kind: str, x: float, y: float) -> bool:
        return kind == self._kind and math.dist((x, y), self._place) < MATCH_WITHIN

    def _search(self, now: float, seen: Observation) -> tuple[str, str] | None:
        """At the place with nothing in view: look around for a while, then say so."""
        if not self.has_place_before_it(seen, AT_PLACE):
            self._at_place_since = None
        elif self._at_place_since is None:
            self._at_place_since = now
            self._arrive()
        elif self._in_view_since is None and now - self._at_place_since > SEARCH_FOR:
            return "refuted", "nothing there"
        return None

    def _arrive(self) -> None:
        if not self._arrived:
            self._arrived = True
            self._tell_arrived()
