"""How a person moves a cursor: one aimed movement after the other, by an imperfect prediction.

A movement is planned as a whole, from where the cursor will be once everything that was asked for
has happened, and then runs its course; meanwhile nothing is corrected. What has not been seen yet
is known from what was asked for and from how late the person takes it to show. It misjudges that
time by a share of it, from one moment to the next, and its hand is noisy: so movements end beside
the target, the farther the longer the delay, and are corrected. Under a longer delay there are
more corrections, and each takes longer to be seen: what delay costs grows faster than the delay.

After a movement a person may watch before it makes another one. How long is a share of the delay
that is small where the delay is short against the person's own patience, and all of it where it
is long: then it moves and waits.

References:
    D. E. Meyer et al.: Optimality in human motor performance: ideal control of rapid aimed
    movements. Psychological Review 95 (1988): primary and corrective submovements.
    P. Gawthrop et al.: Intermittent control: a computational theory of human control. Biological
    Cybernetics 104 (2011): sampled, with a prediction, and a refractory time.
    T. Flash, N. Hogan: The coordination of arm movements. J. Neuroscience 5 (1985): the course.
    J. Gibbon: Scalar expectancy theory and Weber's law in animal timing. Psychological Review 84
    (1977): times are misjudged by a share of them.
    W. R. Ferrell: Remote manipulation with transmission delay. IEEE Trans. Human Factors in
    Electronics HFE-6 (1965): with long delays people come to move and wait by themselves.
"""

from __future__ import annotations

import math
from collections import deque

from dva_sim.agents.operator.strategies.cursor import Sighting, Velocity, slowed
from dva_sim.agents.population import Person

OFTEN = 1.0 / 60.0  # design: time between two frames before two were seen [s]
STEEPNESS = 4.0  # design: of the share of the delay that is waited, so that it rises smoothly


def waited_share(delay: float, patience: float) -> float:
    """Share of the delay that a person watches before it acts again.

    Args:
        delay: [s]
        patience: Delay at which it is a half [s].
    """
    return 1.0 / (1.0 + math.pow(patience / max(delay, OFTEN), STEEPNESS))


def _course(share: float) -> float:
    """Part of the way of a movement with the least jerk, by the part of its time."""
    share = min(max(share, 0.0), 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share * share)


class Submovements:
    """The movements of one person in one trial.

    Args:
        person: Tempo, patience, habits.
        most: Highest speed [m/s].

    Attributes:
        off: Distance of the predicted cursor from the predicted target [m].
        waited: Time spent watching before the next movement [s].
        total: Time since the first frame [s].
    """

    def __init__(self, person: Person, most: float) -> None:
        self._person, self._habits, self._most = person, person.habits.aiming, most
        self._asked: deque[tuple[float, float, float]] = deque()
        self._begun, self._lasts = -math.inf, 0.0
        self._way: Velocity = (0.0, 0.0)
        self._last: float | None = None
        self._gap = OFTEN
        self._pressed = -math.inf
        self.off, self._unseen = math.inf, 0.0
        self.waited = self.total = 0.0

    def point(self, now: float, seen: Sighting, delay: float) -> Velocity:
        """Velocity to ask for [m/s]; a target that moves is followed all the time."""
        if self._last is not None:
            passed = now - self._last
            self.total += passed
            if self._begun + self._lasts < now < self._begun + self._lasts + self._watches(delay):
                self.waited += passed
            self._gap += 0.2 * (min(now - self._last, 0.5) - self._gap)
        self._last = now
        tx, ty, x, y = self._predicted(now, seen, delay)
        dx, dy = tx - x, ty - y
        self.off = math.hypot(dx, dy)
        rests = self._begun + self._lasts + self._watches(delay)
        if now >= rests - 1e-6 and self.off > self._habits.close_enough * seen.tolerance:
            self._plan(now, dx, dy, seen.tolerance)
        vx, vy = self._moving(now)
        wanted = slowed(vx + seen.target_vx, vy + seen.target_vy, self._most)
        self._asked.append((now, *wanted))
        return wanted

    def presses(self, now: float, seen: Sighting, delay: float, hurried: bool) -> bool:
        """Press the button: the prediction is on the target, and so is the eye where it must be.

        What has not been seen yet is trusted if a usual miss of that way is within the tolerance,
        or if a press beside the target costs nothing.
        """
        if now < self._begun + self._lasts or now < self._pressed + delay + self._person.reaction:
            return False
        doubt = 0.0 if hurried else self._habits.doubt * self._unseen
        if doubt > seen.tolerance:
            if math.hypot(seen.target_x - seen.x, seen.target_y - seen.y) > seen.tolerance:
                return False
        elif self.off > (1.0 if hurried else self._habits.careful) * seen.tolerance:
            return False
        self._pressed = now
        return True

    def _watches(self, delay: float) -> float:
        return waited_share(delay, self._person.waits_from) * delay

    def _plan(self, now: float, dx: float, dy: float, tolerance: float) -> None:
        """A movement by so much; the target's own is added to it."""
        habits, off = self._habits, math.hypot(dx, dy)
        bits = math.log2(1.0 + off / (2.0 * max(tolerance, habits.finest_m)))
        lasts = self._person.tempo * (habits.shortest_s + habits.per_bit_s * bits)
        lasts = max(lasts, 1.9 * off / self._most)  # the least jerk is fastest at 1.9 of its mean
        self._begun, self._lasts, self._way = now, lasts, (dx, dy)

    def _moving(self, now: float) -> Velocity:
        since = now - self._begun
        if since >= self._lasts:
            return 0.0, 0.0
        share = (
            _course((since + self._gap) / self._lasts) - _course(since / self._lasts)
        ) / self._gap
        return share * self._way[0], share * self._way[1]

    def _predicted(
        self, now: float, seen: Sighting, delay: float
    ) -> tuple[float, float, float, float]:
        """Target and cursor [m] once everything that was asked for has happened."""
        x, y, since, until = seen.x, seen.y, now - delay, now
        self._unseen = 0.0
        asked, quality = self._asked, self._habits.foresight
        while len(asked) > 1 and asked[1][0] < since - 0.5:
            asked.popleft()
        for at, vx, vy in reversed(asked):
            if until <= since:
                break
            lasts = until - max(at, since)
            self._unseen += lasts * math.hypot(vx - seen.target_vx, vy - seen.target_vy)
            x, y, until = x + quality * vx * lasts, y + quality * vy * lasts, at
        return (
            seen.target_x + seen.target_vx * delay * quality,
            seen.target_y + seen.target_vy * delay * quality,
            x,
            y,
        )
