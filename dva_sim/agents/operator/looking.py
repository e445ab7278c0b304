"""What an operator makes of the pictures from the place of an event, whoever drives the robot."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from dva_sim.agents.camera import CLEAR, SEEN_THROUGH, Observation, SeenHazard
from dva_sim.agents.operator.evidence import Evidence, clearness, worth
from dva_sim.agents.operator.person import Person
from dva_sim.worlds.planning import Planner

AT_PLACE = 1.5  # nearer than this one is at the place [m]
MATCH_WITHIN = 4.0  # a hazard so near the reported place is the one reported [m]
NEARER_AFTER = 5.0  # who could not see the place for so long looks from nearer [s]; assumed

Found = tuple[str, str]


class Looking:
    """Looks for one event until it is confirmed, refuted or given up.

    A person confirms when the evidence is strong enough, and refutes after having looked at the
    place for long enough without being more than half convinced. Who cannot see the place for
    smoke refutes nothing: it waits, and in the end gives up.

    Args:
        kind: Of the event.
        place: Where it is said to be [m].
        planner: The person knows the building.
        person: Who looks.
        luck: Standard normal numbers, one for each look.
        arrived: Called once, when the event or its place is before the robot.
    """

    def __init__(
        self,
        kind: str,
        place: tuple[float, float],
        planner: Planner,
        person: Person,
        luck: Iterator[float],
        arrived: Callable[[], object],
    ) -> None:
        self._kind, self._place, self._planner, self._person = kind, place, planner, person
        self._evidence = Evidence(person.sensitivity, person.confirm_look, luck)
        self._tell_arrived, self._arrived = arrived, False
        self._last: float | None = None
        self._searched = self._blind = 0.0
        self.at_place = False

    @property
    def wants_nearer(self) -> bool:
        """Whether the place could not be seen for some time."""
        return self._blind > NEARER_AFTER

    def look(self, now: float, seen: Observation) -> Found | None:
        """A picture is perceived at `now` [s]: the outcome and why, once there is one."""
        gap = math.inf if self._last is None else now - self._last
        self._last = now
        event = self._event_in(seen)
        if event is not None:
            self._arrive()
            self._evidence.weigh(worth(gap), clearness(event.angle), event.contrast)
        was_there, self.at_place = self.at_place, self.has_place_before_it(seen, AT_PLACE)
        found = self._search(gap if was_there else 0.0, seen, event is None)
        return ("confirmed", "") if self._evidence.sure else found

    def look_away(self) -> None:
        """The person looks at something else: what is not seen counts for nothing."""
        self._last, self.at_place = None, False

    def has_place_before_it(self, seen: Observation, within: float) -> bool:
        """Whether the place is near [m], and by the map no wall stands between."""
        here = seen.x, seen.y
        near = math.dist(here, self._place) < within
        return near and self._planner.line_of_sight(here, self._place)

    def _event_in(self, seen: Observation) -> SeenHazard | None:
        """The event, if it is in the picture."""
        near = (h for h in seen.hazards if math.dist((h.x, h.y), self._place) < MATCH_WITHIN)
        return next((h for h in near if h.kind == self._kind), None)

    def _search(self, gap: float, seen: Observation, nothing: bool) -> Found | None:
        """At the place: look around for a while, if anything can be seen, then say so.

        Args:
            gap: How long the person has been looking since the last picture [s].
            seen: The picture.
            nothing: Whether the event is not in it.
        """
        if not self.at_place:
            return None
        self._arrive()
        contrast = self._contrast_at_place(seen)
        if nothing and contrast <= math.exp(-SEEN_THROUGH):
            self._blind += gap
            too_long = self._blind > self._person.patience
            return ("gave up", "nothing can be seen") if too_long else None
        if nothing:
            self._evidence.weigh(worth(gap), 0.0, contrast)
        self._searched += gap
        if self._searched > self._person.search and not self._evidence.leans:
            return "refuted", "nothing there"
        return None

    def _contrast_at_place(self, seen: Observation) -> float:
        """Share of its contrast that the smoke before the place leaves."""
        if seen.visibility >= CLEAR:
            return 1.0
        distance = math.dist((seen.x, seen.y), self._place)
        return math.exp(-SEEN_THROUGH * distance / seen.visibility)

    def _arrive(self) -> None:
        if not self._arrived:
            self._arrived = True
            self._tell_arrived()
