"""Estimation of the delay by a person, who compares seen motion with own commands."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.habits import AimingHabits, DelayHabits

Floats = NDArray[np.float64]

STEP = 0.1  # design: resolution of the memory and of the guess while driving [s]
LOOK_STEPS = 2  # design: number of steps between two updates of the estimate


class DelayEstimate:
    """A running guess of the time from an intent to its effect in the picture.

    For each candidate lag it keeps how badly the motion seen now fits what was asked for that
    long ago, forgetting slowly; the guess is the lag that fits best. A look counts for the time
    since the one before, and as much is forgotten by it: how fast a delay is learnt hardly depends
    on how many frames there are. While nothing changes all lags fit alike, and the guess stays.
    Nobody tells a person the delay: this is all that it knows.

    Args:
        start: Start of the drive or the trial [s].
        guess: Initial estimate, learnt before [s].
        step: Resolution of the guess [s].
        scale: Difference that counts as one in each of the two channels, in its unit; by default
            those of driving.
        habits: Habits of the person.
        hand: Lag of the hand, which is felt: only the rest is learnt from the picture [s].

    Attributes:
        value: The guess of the whole delay, the hand's lag in it [s].
    """

    def __init__(
        self,
        start: float,
        guess: float,
        step: float = STEP,
        scale: tuple[float, float] | None = None,
        habits: DelayHabits | None = None,
        hand: float = 0.0,
    ) -> None:
        self._habits = habits = habits or DelayHabits()
        self._hand = hand
        scale = scale or (habits.speed_scale_mps, habits.turn_scale_rad_s)
        self._start = self._next_look = start
        self._step = step
        self._period = LOOK_STEPS * step
        self._last: float | None = None
        self._motion = np.zeros((2, 1))
        self._lags = np.arange(1, round(habits.remembers_s / step) + 1) * step
        # One for each lag: NumPy takes three times as long to spread one over all.
        self._weights = np.repeat([[1.0 / scale[0]], [1.0 / scale[1]]], len(self._lags), axis=1)
        self._offset = self._filled = 2 * len(self._lags)
        self._asked = np.zeros((2, 4 * len(self._lags)))
        self._intent = self._felt = 0.0, 0.0
        self._misfit = habits.firmness * np.abs(self._lags - (guess - hand))
        self.value = guess

    def intend(self, now: float, one: float, other: float) -> None:
        """Note the person's command from `now` [s] on: speed and turn rate, or velocities."""
        self._remember(now)
        self._intent = one, other

    def see(self, now: float, one: float, other: float, over: float = 0.0) -> None:
        """Compare the motion in the picture at `now` [s] with the commands.

        A motion that was summed over a time is compared with what was asked for over as long.

        Args:
            now: [s]
            one: First component of the motion; see `intend`.
            other: Second component of the motion.
            over: The time up to `now` over which the motion was summed [s].
        """
        if now < self._next_look:
            return
        self._next_look = now + self._period
        self._remember(now)
        steps = min(max(1, round(over / self._step)), len(self._lags)) if over else 1
        motion = self._motion
        motion[0, 0] = one
        motion[1, 0] = other
        errors = self._past(steps) - motion
        np.abs(errors, out=errors)
        errors *= self._weights
        error = errors[0]
        error += errors[1]
        np.minimum(error, self._habits.most_misfit, out=error)
        fades_in = self._habits.fades_in_s
        passed = 0.0 if self._last is None else min(now - self._last, fades_in)
        self._last = now
        if passed < 2.0 * self._period:  # frames do not arrive exactly in step
            passed = self._period
        error *= passed
        misfit = self._misfit
        misfit *= math.exp(-passed / fades_in)
        misfit += error[::-1]
        self.value = float(self._lags[misfit.argmin()]) + self._hand

    def rest(self) -> None:
        """Pause: time without looking does not count as time without motion."""
        self._last = None

    def _past(self, steps: int) -> Floats:
        """Return past requests, `(2, lags)`, averaged over some steps up to each; oldest first."""
        past = self._asked[:, self._filled - len(self._lags) - steps + 1 : self._filled]
        if steps == 1:
            return past
        share = np.full(steps, 1.0 / steps)
        return np.stack([np.convolve(requests, share, "valid") for requests in past])

    def _remember(self, now: float) -> None:
        """Fill the memory with the standing intent up to `now`."""
        due = self._offset + int((now - self._start) / self._step + 1e-6)
        if due <= self._filled:
            return
        while due >= self._asked.shape[1]:
            self._asked = np.hstack([self._asked, np.zeros_like(self._asked)])
        since = slice(self._filled, due)
        steps = due - self._filled
        self._filled = due
        if not self._hand:
            self._asked[0, since], self._asked[1, since] = self._intent
            return
        left = np.exp(-self._step / self._hand * np.arange(1, steps + 1))
        for channel, (to, felt) in enumerate(zip(self._intent, self._felt, strict=True)):
            self._asked[channel, since] = to + (felt - to) * left
        one, other = self._asked[:, due - 1].tolist()
        self._felt = one, other


class PeriodEstimate:
    """Estimate of the period of effective commands, from the times at which requests take effect.

    A change that is asked for takes effect after the delay and the time until the next command
    gets through. So times to effects differ by up to the period, a move lasts by up to a period
    longer or shorter than asked, and one that is shorter than the period may have no effect at
    all. The person weighs periods by how well they explain what it saw (Bayes' rule over a few
    dozen periods, forgetting slowly), and counts on one that is as long as most of these.

    Args:
        habits: Changes that are noticed, and how many effects are remembered.

    Attributes:
        value: Period that the person relies on [s]; 0 before any evidence.
        likely: Median of the estimated period [s]; 0 before any evidence.
    """

    MEMORY = 4.0  # design: number of periods over which evidence fades
    SHORTEST = 0.1  # design: period that is weighed [s]
    LONGEST = 10.0  # design: period that is weighed [s]
    STEPS = 40  # design: periods that are weighed
    SURE = 0.95  # design: share of the weight below the period that is counted on
    BLURRED = 0.3  # design: times that differ by less are the same to a person [s]
    SURPRISE = 0.02  # design: likelihood of an observation that a period does not explain
    EARLY = 0.5  # design: share of the delay; earlier motion belongs to an earlier command
    LATE = 1.5  # design: share of the delay

    def __init__(self, habits: DelayHabits) -> None:
        self._habits = habits
        self._lags: deque[float] = deque(maxlen=habits.effects)
        # Two, since a turn that was lost is no less lost if the robot went on.
        self._channels = _Channel(), _Channel()
        self._delay = 0.0
        self._periods = np.geomspace(self.SHORTEST, self.LONGEST, self.STEPS)
        self._prior = -np.log(self._periods)  # links are usually quick
        self._weights = np.zeros(self.STEPS)
        self.value = self.likely = 0.0

    def intend(self, now: float, one: float, other: float) -> None:
        """Note the person's command from `now` [s] on, as shares of the limits."""
        for channel, speed in zip(self._channels, (one, other), strict=True):
            lost = channel.ask(now, self._delay, asks=abs(speed) >= self._habits.noticed)
            if lost > 0.0:
                self._weigh(1.0 - np.minimum(lost / self._periods, 1.0))

    def see(self, now: float, one: float, other: float, delay: float) -> float:
        """Compare the motion in the picture with the commands, both as shares of the limits.

        The period as it is taken now.

        Args:
            now: [s]
            one: First component of the motion; see `intend`.
            other: Second component of the motion.
            delay: Whole delay as the person perceives it [s].
        """
        self._delay = delay
        for channel, motion in zip(self._channels, (one, other), strict=True):
            moves = abs(motion) >= 0.5 * self._habits.noticed
            move = channel.move
            channel.moves = moves
            if move is not None:
                channel.move = self._learn(move, now, delay, moves=moves)
        return self.value

    def _learn(self, move: _Move, now: float, delay: float, *, moves: bool) -> _Move | None:
        """Learn from a picture of a move; the move, as long as more of it will be seen."""
        if move.seen is None and moves:
            lag = now - move.begun
            if lag < self.EARLY * delay:
                return None
            if self._lags:
                span = self._periods + self.BLURRED
                self._weigh(np.where(abs(lag - min(self._lags)) <= span, self.BLURRED / span, 0.0))
            self._lags.append(lag)
            return move._replace(seen=now)
        if move.ended is None:
            return move
        length = move.ended - move.begun
        if move.seen is not None and not moves:
            self._lasted(now - move.seen, length)
            return None
        if move.seen is None and now > move.ended + self.LATE * delay + self.value:
            self._weigh(1.0 - np.minimum(length / self._periods, 1.0))
            return None
        return move

    def _lasted(self, lasts: float, length: float) -> None:
        """Note how long a move lasted [s]: the whole periods just below or above what was asked."""
        whole, part = np.divmod(length / self._periods, 1.0)
        less, more = (
            np.exp(-0.5 * ((lasts - count * self._periods) / self.BLURRED) ** 2)
            for count in (whole, whole + 1.0)
        )
        self._weigh((1.0 - part) * less + part * more)

    def _weigh(self, likelihoods: Floats) -> None:
        """Update the weights of the periods by an observation."""
        self._weights *= 1.0 - 1.0 / (self.MEMORY * self._habits.effects)
        self._weights += np.log(np.maximum(likelihoods, self.SURPRISE))
        shares = np.cumsum(np.exp(self._prior + self._weights - self._weights.max()))
        places = np.searchsorted(shares, shares[-1] * np.array([0.5, self.SURE]))
        self.likely, self.value = self._periods[np.minimum(places, self.STEPS - 1)].tolist()


class _Move(NamedTuple):
    """A motion that began at rest, with the times at which it was seen [s]."""

    begun: float
    ended: float | None = None
    seen: float | None = None


class _Channel:
    """Speed or turn rate: whether it is asked for and seen, and the move that is followed.

    Attributes:
        move: Move that is followed; None: a move that began while another was still seen teaches
            nothing.
        moves: True while motion is seen.
    """

    def __init__(self) -> None:
        self.move: _Move | None = None
        self._asks = self.moves = False

    def ask(self, now: float, delay: float, *, asks: bool) -> float:
        """Ask for motion from `now` [s] on, or for rest.

        The length of a move that was lost [s].

        Args:
            now: [s]
            delay: Delay after which the last move should be visible [s].
            asks: True if motion is requested.
        """
        lost = 0.0
        last = self.move
        if asks and not self._asks:
            if last is not None and last.ended is not None and last.seen is None:
                lost = last.ended - last.begun if now >= last.ended + delay else 0.0
            has_begun = last is None or lost > 0.0
            self.move = _Move(now) if has_begun and not self.moves else None
        elif self._asks and not asks and self.move is not None:
            self.move = self.move._replace(ended=now)
        self._asks = asks
        return lost


class Timing:
    """Misjudgement of a time by a person: a share of it that changes from moment to moment.

    Args:
        habits: Habits that set the size and speed of the errors.
        rng: Random generator of the errors.

    References:
        J. Gibbon: Scalar expectancy theory and Weber's law in animal timing. Psychological Review
        84 (1977): the standard deviation of a judged time is a share of it.
    """

    def __init__(self, habits: AimingHabits, rng: np.random.Generator) -> None:
        self._habits = habits
        self._rng = rng
        self._last = 0.0
        self._state = float(rng.normal())

    def at(self, now: float) -> float:
        """Return the perceived length of a time at `now` [s], as a multiple of it."""
        keep = math.exp(-max(now - self._last, 0.0) / self._habits.recalls_s)
        fresh = math.sqrt(1.0 - keep * keep)
        self._state = keep * self._state + fresh * float(self._rng.standard_normal())
        self._last = now
        return math.exp(self._habits.misjudges * self._state)

    def judged(self, delay: float, usual: float, now: float) -> float:
        """Return the perceived delay at a moment [s]: only its new part is misjudged.

        Args:
            delay: Learnt delay [s].
            usual: Delay that the person is used to [s].
            now: [s]
        """
        return delay + max(delay - usual, 0.0) * (self.at(now) - 1.0)
