"""Movements of a cursor: one aimed movement after the other, by an imperfect prediction.

A movement is planned as a whole, from where the cursor will be once everything that was asked for
has happened, and then runs its course; meanwhile nothing is corrected. It ends beside the target by
a share of its way, and is corrected. What has not been seen yet is known from what was asked for,
from the hand, which is felt, and from how late a picture usually is. Of a delay beyond the usual
one only a share is counted on. What was asked for before that, and is not seen yet, is asked for
once more: hardly anything while the new delay is short against a movement, and more and more of it
when it is longer. So corrections collide, and what delay costs grows faster than the delay.

After a movement a person acts again at once, or waits until it has seen what came of it. It waits
the more often the longer the new delay is against the person's own patience, and the more of its
movements have failed: with long delays it moves and waits.

References:
    D. E. Meyer et al.: Optimality in human motor performance: ideal control of rapid aimed
    movements. Psychological Review 95 (1988): primary and corrective submovements.
    P. Gawthrop et al.: Intermittent control: a computational theory of human control. Biological
    Cybernetics 104 (2011): sampled, with a prediction, and a refractory time.
    N. F. Foulkes, R. C. Miall: Adaptation to visual feedback delays in a human manual tracking
    task. Experimental Brain Research 131 (2000): people adapt to a new delay in part.
    T. Flash, N. Hogan: The coordination of arm movements. J. Neuroscience 5 (1985): the course.
    J. Gibbon: Scalar expectancy theory and Weber's law in animal timing. Psychological Review 84
    (1977): times are misjudged by a share of them.
    W. R. Ferrell: Remote manipulation with transmission delay. IEEE Trans. Human Factors in
    Electronics HFE-6 (1965): with long delays people come to move and wait by themselves.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator

from dva_sim.agents.operator.strategies.cursor import Sighting, Velocity, slowed
from dva_sim.agents.population import Person

USUAL_FRAME_S = 1.0 / 60.0  # design: assumed time between frames until two have been seen [s]
FAILS = 0.5  # design: a movement has failed if more than this share of its way is left
STEEPNESS = 6.0  # design: of the share of movements that are waited for; persons differ as well


def waited_share(delay: float, patience: float) -> float:
    """Return the share of its movements after which a person waits to see what came of them.

    Args:
        delay: Beyond the usual one, as it is felt [s].
        patience: Delay at which it is a half [s].
    """
    return 1.0 / (1.0 + math.pow(patience / max(delay, USUAL_FRAME_S), STEEPNESS))


def _course(share: float) -> float:
    """Return the part of the way of a movement with the least jerk, by the part of its time."""
    share = min(max(share, 0.0), 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share * share)


def foreseen(place: float, velocity: float, ahead: float, edge: float) -> tuple[float, float]:
    """Place [m] and velocity [m/s] of a target along one axis after a time: it turns at the edge.

    Args:
        place: [m]
        velocity: [m/s]
        ahead: [s]
        edge: [m]
    """
    place += velocity * ahead
    if abs(place) > edge and place * velocity > 0.0:
        return math.copysign(2.0 * edge, place) - place, -velocity
    return place, velocity


class Submovements:
    """The movements of one person in one trial.

    Args:
        person: Tempo, patience, habits.
        most: Highest speed [m/s].

    Attributes:
        off: Distance of the predicted cursor from the predicted target [m].
        waited: Time spent waiting before the next movement [s].
        total: Time since the first frame [s].
    """

    def __init__(self, person: Person, most: float) -> None:
        self._person = person
        self._habits = person.habits.aiming
        self._most = most
        self._usual = person.usual_delay
        self._asked: deque[tuple[float, float, float]] = deque()
        self._begun = -math.inf
        self._lasts = 0.0
        self._way: Velocity = (0.0, 0.0)
        self._last: float | None = None
        self._gap = USUAL_FRAME_S
        self._pressed = -math.inf
        self._failures = 0
        self._boldness = 0.0
        self.off = math.inf
        self._unseen = 0.0
        self.waited = self.total = 0.0

    def point(self, now: float, seen: Sighting, delay: float, noise: Iterator[float]) -> Velocity:
        """Return the velocity to ask for [m/s]; a target that moves is followed all the time.

        Args:
            now: [s]
            seen: The newest frame.
            delay: Perceived whole delay [s].
            noise: Standard normal numbers, three for each movement.
        """
        if self._last is not None:
            passed = now - self._last
            self.total += passed
            if self._begun + self._lasts < now < self._rests_until(delay):
                self.waited += passed
            self._gap += 0.2 * (min(now - self._last, 0.5) - self._gap)
        self._last = now
        new = max(delay - self._usual, 0.0)
        counted = min(delay, self._usual) + self._person.compensates * new
        tx, target_vx = foreseen(seen.target_x, seen.target_vx, counted, seen.edge)
        ty, target_vy = foreseen(seen.target_y, seen.target_vy, counted, seen.edge)
        x, y = self._predicted(now, seen, counted)
        dx = tx - x
        dy = ty - y
        self.off = math.hypot(dx, dy)
        if (
            now >= self._rests_until(delay) - 1e-6
            and self.off > self._habits.close_enough * seen.tolerance
        ):
            self._plan(now, dx, dy, seen.tolerance, noise)
        vx, vy = self._moving(now)
        velocity = slowed(vx + target_vx, vy + target_vy, self._most)
        self._asked.append((now, *velocity))
        return velocity

    def presses(self, now: float, seen: Sighting, delay: float, hurried: bool) -> bool:
        """Press the button: the prediction is on the target, and so is the eye where it must be.

        A motion not seen yet is trusted if a usual miss of that way is within the tolerance.
        Where a press beside the target costs nothing, it presses once it has made a movement.
        """
        person = self._person
        settled = self._begun + self._lasts + self._habits.settles * person.tempo * person.hand_lag
        if now < settled or now < self._pressed + delay + person.reaction:
            return False
        doubt = self._habits.doubt * self._unseen
        if hurried:
            if self._begun == -math.inf:
                return False
        elif doubt > seen.tolerance:
            if math.hypot(seen.target_x - seen.x, seen.target_y - seen.y) > seen.tolerance:
                return False
        elif self.off > self._habits.careful * seen.tolerance:
            return False
        self._pressed = now
        return True

    def _rests_until(self, delay: float) -> float:
        """Return when it may act again [s]: at once, or once the last result is visible."""
        ended = self._begun + self._lasts
        new = max(delay - self._usual, 0.0) * (1.0 + self._habits.ruffled * self._failures)
        if self._boldness < 1.0 - waited_share(new, self._person.waits_from):
            return ended
        return ended + delay + self._person.habits.waiting.settled_s

    def _plan(
        self, now: float, dx: float, dy: float, tolerance: float, noise: Iterator[float]
    ) -> None:
        """Plan a movement by so much, which misses by a share of it; the target's own is added."""
        habits = self._habits
        off = math.hypot(dx, dy)
        along = habits.misses * next(noise)
        across = habits.misses * next(noise)
        self._boldness = 0.5 * math.erfc(next(noise) / math.sqrt(2.0))  # even, from 0 to 1
        if off > FAILS * math.hypot(*self._way) > 0.0:
            self._failures += 1
        bits = math.log2(1.0 + off / (2.0 * max(tolerance, habits.finest_m)))
        lasts = self._person.tempo * (habits.shortest_s + habits.per_bit_s * bits)
        lasts = max(lasts, 1.9 * off / self._most)  # the least jerk is fastest at 1.9 of its mean
        self._begun = now
        self._lasts = lasts
        self._way = dx + along * dx - across * dy, dy + along * dy + across * dx

    def _moving(self, now: float) -> Velocity:
        since = now - self._begun
        if since >= self._lasts:
            return 0.0, 0.0
        share = (
            _course((since + self._gap) / self._lasts) - _course(since / self._lasts)
        ) / self._gap
        return share * self._way[0], share * self._way[1]

    def _predicted(self, now: float, seen: Sighting, counted: float) -> Velocity:
        """Return the cursor [m] once everything that was asked for has happened.

        The hand follows what is asked for with a lag that the person knows: what was asked for
        longer ago than the rest of the delay is seen but for the share that the hand still lacks.
        """
        x = seen.x
        y = seen.y
        until = now
        hand = self._person.hand_lag
        dead = max(counted - hand, 0.0)
        self._unseen = 0.0
        commands = self._asked
        while len(commands) > 1 and commands[1][0] < now - dead - 5.0 * hand:
            commands.popleft()
        for at, vx, vy in reversed(commands):
            age = now - 0.5 * (at + until) - dead
            lasts = (until - at) * (1.0 if age <= 0.0 else math.exp(-age / hand))
            self._unseen += lasts * math.hypot(vx - seen.target_vx, vy - seen.target_vy)
            x = x + vx * lasts
            y = y + vy * lasts
            until = at
        return x, y
