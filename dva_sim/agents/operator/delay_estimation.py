"""How a person comes to know the delay: by matching what it sees to what it did."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.habits import DelayHabits

Floats = NDArray[np.float64]

STEP = 0.1  # design: resolution of the memory and of the guess while driving [s]
LOOK_STEPS = 2  # design: the guess is looked at every so many steps


class DelayEstimate:
    """A running guess of the time from an intent to its effect in the picture.

    For each candidate lag it keeps how badly the motion seen now fits what was asked for that
    long ago, forgetting slowly; the guess is the lag that fits best. A look counts for the time
    since the one before, and as much is forgotten by it: how fast a delay is learnt hardly depends
    on how many frames there are. While nothing changes all lags fit alike, and the guess stays.
    Nobody tells a person the delay: this is all that it knows.

    Args:
        start: When the drive or the trial begins [s].
        guess: What the person expects at first: what it learnt before [s].
        step: Resolution of the guess [s].
        scale: For each of the two channels, the difference that counts one, in its unit; left
            out: those of driving.
        habits: Of the person.

    Attributes:
        value: The guess [s].
    """

    def __init__(
        self,
        start: float,
        guess: float,
        step: float = STEP,
        scale: tuple[float, float] | None = None,
        habits: DelayHabits | None = None,
    ) -> None:
        self._habits = habits = habits or DelayHabits()
        scale = scale or (habits.speed_scale_mps, habits.turn_scale_rad_s)
        self._start = self._next_look = start
        self._step, self._period = step, LOOK_STEPS * step
        self._last: float | None = None
        self._motion = np.zeros((2, 1))
        self._lags = np.arange(1, round(habits.remembers_s / step) + 1) * step
        # One for each lag: NumPy takes three times as long to spread one over all.
        self._weights = np.repeat([[1.0 / scale[0]], [1.0 / scale[1]]], len(self._lags), axis=1)
        self._offset = self._filled = 2 * len(self._lags)
        self._asked = np.zeros((2, 4 * len(self._lags)))
        self._intent = 0.0, 0.0
        self._misfit = habits.firmness * np.abs(self._lags - guess)
        self.value = guess

    def intend(self, now: float, one: float, other: float) -> None:
        """The person asks for this from `now` [s] on: speed and turn rate, or two velocities."""
        self._remember(now)
        self._intent = one, other

    def see(self, now: float, one: float, other: float, over: float = 0.0) -> None:
        """The picture shows this motion at `now` [s].

        A motion that was summed over a time is compared with what was asked for over as long.

        Args:
            now: [s]
            one: Of the motion; see `intend`.
            other: Likewise.
            over: The time up to `now` over which the motion was summed [s].
        """
        if now < self._next_look:
            return
        self._next_look = now + self._period
        self._remember(now)
        steps = min(max(1, round(over / self._step)), len(self._lags)) if over else 1
        motion = self._motion
        motion[0, 0], motion[1, 0] = one, other
        errors = self._past(steps) - motion
        np.abs(errors, out=errors)
        errors *= self._weights
        error = errors[0]
        error += errors[1]
        np.minimum(error, self._habits.most_misfit, out=error)
        fades_in = self._habits.fades_in_s
        passed = 0.0 if self._last is None else min(now - self._last, fades_in)
        self._last = now
        if passed < 2.0 * self._period:  # frames come a little sooner or later than one looks
            passed = self._period
        error *= passed
        misfit = self._misfit
        misfit *= math.exp(-passed / fades_in)
        misfit += error[::-1]
        self.value = float(self._lags[misfit.argmin()])

    def rest(self) -> None:
        """Nothing is looked at for a while; that time stands for nothing seen."""
        self._last = None

    def _past(self, steps: int) -> Floats:
        """What was asked for, `(2, lags)`, the mean over some steps up to each; oldest first."""
        past = self._asked[:, self._filled - len(self._lags) - steps + 1 : self._filled]
        if steps == 1:
            return past
        share = np.full(steps, 1.0 / steps)
        return np.stack([np.convolve(asked, share, "valid") for asked in past])

    def _remember(self, now: float) -> None:
        """Fill the memory with the standing intent up to `now`."""
        due = self._offset + int((now - self._start) / self._step + 1e-6)
        if due <= self._filled:
            return
        while due >= self._asked.shape[1]:
            self._asked = np.hstack([self._asked, np.zeros_like(self._asked)])
        since, (one, other) = slice(self._filled, due), self._intent
        self._asked[0, since], self._asked[1, since] = one, other
        self._filled = due
