"""Inspection of an event: the evidence by which an operator confirms or refutes it.

Each look at a picture gives a little noisy evidence for or against. What speaks for it adds up;
what speaks against it takes that away again, but not below nothing: a long time without a sight
makes nobody harder to convince. From a level on, the criterion, the person is sure. It may be
wrong: noise alone gets there too, the rarer the higher the criterion and the clearer the pictures.

References:
    R. Ratcliff, G. McKoon: The diffusion decision model: theory and data for two-choice decision
    tasks. Neural Computation 20 (2008) 873-922.
    E. S. Page: Continuous inspection schemes. Biometrika 41 (1954) 100-115 (a sum that is never
    below nothing).
    D. M. Green, J. A. Swets: Signal Detection Theory and Psychophysics. Wiley, 1966.
    A. Nuthmann: Fixation durations in scene viewing. Psychonomic Bulletin & Review 24 (2017)
    370-392 (the eyes move about three times a second).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from dva_sim.agents.habits import LookingHabits
from dva_sim.agents.observation import CLEAR, SEEN_THROUGH, Observation, SeenHazard
from dva_sim.agents.population import Person
from dva_sim.worlds.planning import Planner

FIXATION_S = 1.0 / 3.0  # source: Nuthmann 2017: a still picture is worth one fixation [s]


def clearness(angle: float, half_seen: float) -> float:
    """Return clearness of something in a picture, from 0 to 1, by the angle that it fills [rad].

    Args:
        angle: [rad]
        half_seen: Visual angle at which the event is half recognisable [rad].
    """
    return float(1.0 - 2.0 ** (-angle / half_seen))


def worth(gap: float) -> float:
    """Return the weight of the pictures of the last `gap` [s], as time of a moving picture [s].

    So evidence arrives at the rate of new pictures, up to three per second.
    """
    return min(gap, FIXATION_S)


class WeighedEvidence:
    """Evidence for an event, as one person weighs it.

    In a clear picture the level drifts by `sensitivity / 2` a second towards the criterion if the
    event fills the picture, and away from it if it is not there; the noise has a variance of 1 a
    second. In a picture of contrast `c` the drift is `c^1.5` of that (with the usual discount) and
    the variance `c`: a person discounts what is unclear, but less than would keep the errors as
    rare.

    Args:
        sensitivity: Sensitivity of the person: how well a second in plain view tells an event from
            none, in standard deviations [1/sqrt(s)].
        look: Time for which an event in plain view is looked at until the person is sure [s]; it
            sets the criterion.
        normals: Standard normal numbers, one for each look.
        habits: Habits of the person.

    Attributes:
        level: Level of the evidence.
        criterion: Level from which on the person is sure.
    """

    def __init__(
        self, sensitivity: float, look: float, normals: Iterator[float], habits: LookingHabits
    ) -> None:
        self._sensitivity = sensitivity
        self._normals = normals
        self._habits = habits
        self.criterion = 0.5 * sensitivity * look
        self.level = 0.0

    @property
    def sure(self) -> bool:
        """True if the person confirms the event."""
        return self.level >= self.criterion

    @property
    def leans(self) -> bool:
        """True if the person is more than half convinced."""
        return self.level >= self._habits.leans_from * self.criterion

    def weigh(self, duration: float, clear: float, contrast: float) -> None:
        """Look for some time [s].

        Args:
            duration: Effective length of the look.
            clear: Similarity of the view to the event, from 0 (none) to 1.
            contrast: Share of the contrast that smoke leaves.
        """
        weight = math.sqrt(contrast)
        drift = weight * contrast**self._habits.discount * self._sensitivity * (clear - 0.5)
        noise = weight * math.sqrt(duration) * next(self._normals)
        self.level = max(0.0, self.level + drift * duration + noise)


Conclusion = tuple[str, str]


class Looking:
    """Looks for one event until it is confirmed, refuted or given up.

    A person confirms when the evidence is strong enough, and refutes after having looked at the
    place for long enough without being more than half convinced. Who cannot see the place for
    smoke refutes nothing: it waits, and in the end gives up.

    Args:
        kind: Kind of the event.
        place: Reported position [m].
        planner: The person knows the building.
        normals: Standard normal numbers, one for each look.
        arrived: Callback once the event or its place is before the robot.
    """

    def __init__(
        self,
        kind: str,
        place: tuple[float, float],
        *,
        planner: Planner,
        person: Person,
        normals: Iterator[float],
        arrived: Callable[[], object],
    ) -> None:
        self._kind = kind
        self._place = place
        self._planner = planner
        self._person = person
        self._habits = habits = person.habits.looking
        self._evidence = WeighedEvidence(person.sensitivity, person.confirm_look, normals, habits)
        self._tell_arrived = arrived
        self._arrived = False
        self._last: float | None = None
        self._searched = self._blind = 0.0
        self.at_place = False

    @property
    def wants_nearer(self) -> bool:
        """True if the place could not be seen for some time."""
        return self._blind > self._habits.nearer_after_s

    def look(self, now: float, seen: Observation) -> Conclusion | None:
        """Perceive a picture at `now` [s]; return the outcome and why, once there is one."""
        gap = math.inf if self._last is None else now - self._last
        self._last = now
        event = self._event_in(seen)
        if event is not None:
            self._arrive()
            clear = clearness(event.angle, self._habits.half_seen_rad)
            self._evidence.weigh(worth(gap), clear, event.contrast)
        was_there = self.at_place
        self.at_place = self.has_place_before_it(seen, self._habits.at_place_m)
        conclusion = self._search(gap if was_there else 0.0, seen, event is None)
        return ("confirmed", "") if self._evidence.sure else conclusion

    def look_away(self) -> None:
        """Look away: no evidence accumulates meanwhile."""
        self._last = None
        self.at_place = False

    def has_place_before_it(self, seen: Observation, within: float) -> bool:
        """Return True if the place is near [m], and no wall of the map stands between."""
        here = seen.x, seen.y
        near = math.dist(here, self._place) < within
        return near and self._planner.line_of_sight(here, self._place)

    def _event_in(self, seen: Observation) -> SeenHazard | None:
        """Return the event, if it is in the picture."""
        if not seen.hazards:
            return None
        place = self._place
        within = self._habits.same_place_m
        near = (h for h in seen.hazards if math.dist((h.x, h.y), place) < within)
        return next((h for h in near if h.kind == self._kind), None)

    def _search(self, gap: float, seen: Observation, nothing: bool) -> Conclusion | None:
        """Look around at the place for a while, if anything can be seen, then say so.

        Args:
            gap: Looking time since the last picture [s].
            seen: The picture.
            nothing: True if the event is not in the picture.
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
        """Return the share of its contrast that the smoke before the place leaves."""
        if seen.visibility >= CLEAR:
            return 1.0
        distance = math.dist((seen.x, seen.y), self._place)
        return math.exp(-SEEN_THROUGH * distance / seen.visibility)

    def _arrive(self) -> None:
        if not self._arrived:
            self._arrived = True
            self._tell_arrived()
