"""How a person comes to know the delay: by matching what it sees to what it did."""

from __future__ import annotations

import numpy as np

STEP = 0.1  # resolution of the memory and of the guess [s]
LONGEST = 8.0  # [s]
LOOKS = 0.2  # how often the guess is looked at [s]
MEMORY = 0.96  # share of the old evidence kept at each look: it fades in about 5 s


class DelayEstimate:
    """A running guess of the time from an intent to its effect in the picture.

    For each candidate lag it keeps how badly the motion seen now fits what was asked for
    that long ago, forgetting slowly; the guess is the lag that fits best. While nothing
    changes all lags fit alike, and the guess stays.

    Args:
        start: When the drive begins [s].
        guess: What the person expects at first [s].
    """

    def __init__(self, start: float, guess: float) -> None:
        self._start = self._next_look = start
        self._lags = np.arange(1, round(LONGEST / STEP) + 1) * STEP
        self._offset = self._filled = len(self._lags)
        self._speeds, self._turns = np.zeros(4096), np.zeros(4096)
        self._intent = (0.0, 0.0)
        self._misfit = 0.02 * np.abs(self._lags - guess)
        self.value = guess

    def intend(self, now: float, speed: float, turn_rate: float) -> None:
        """The person asks for this from `now` [s] on: speed [m/s], turn rate [rad/s]."""
        self._remember(now)
        self._intent = speed, turn_rate

    def see(self, now: float, speed: float, turn_rate: float) -> None:
        """The picture shows this motion at `now` [s]."""
        if now < self._next_look:
            return
        self._next_look = now + LOOKS
        self._remember(now)
        newest = self._filled
        past = slice(newest - len(self._lags), newest)
        error = np.abs(self._speeds[past] - speed)
        error *= 2.0
        error += np.abs(self._turns[past] - turn_rate)
        np.minimum(error, 0.5, out=error)
        misfit = self._misfit
        misfit *= MEMORY
        misfit += error[::-1]
        self.value = float(self._lags[misfit.argmin()])

    def _remember(self, now: float) -> None:
        """Fill the memory with the standing intent up to `now`."""
        due = self._offset + int((now - self._start) / STEP + 1e-6)
        if due <= self._filled:
            return
        while due >= len(self._speeds):
            self._speeds = np.append(self._speeds, np.zeros_like(self._speeds))
            self._turns = np.append(self._turns, np.zeros_like(self._turns))
        self._speeds[self._filled : due], self._turns[self._filled : due] = self._intent
        self._filled = due
