"""How a person comes to know the delay: by matching what it sees to what it did."""

from __future__ import annotations

import numpy as np

STEP = 0.1  # resolution of the memory and of the guess [s]
LONGEST = 8.0  # [s]
MEMORY = 0.98  # share of the old evidence kept per frame: about 5 s at 10 frames/s


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
        self._start = start
        self._lags = np.arange(1, round(LONGEST / STEP) + 1) * STEP
        self._asked = np.zeros((4096, 2))
        self._offset = len(self._lags)
        self._filled = self._offset
        self._intent = (0.0, 0.0)
        self._misfit = 0.02 * np.abs(self._lags - guess)
        self.value = guess

    def intend(self, now: float, speed: float, turn_rate: float) -> None:
        """The person asks for this from `now` [s] on: speed [m/s], turn rate [rad/s]."""
        self._remember(now)
        self._intent = speed, turn_rate

    def see(self, now: float, speed: float, turn_rate: float) -> None:
        """The picture shows this motion at `now` [s]."""
        self._remember(now)
        newest = self._filled
        past = self._asked[newest - len(self._lags) : newest][::-1]
        error = np.abs(past[:, 0] - speed) * 2.0 + np.abs(past[:, 1] - turn_rate)
        self._misfit *= MEMORY
        self._misfit += np.minimum(error, 0.5)
        self.value = float(self._lags[int(np.argmin(self._misfit))])

    def _remember(self, now: float) -> None:
        """Fill the memory with the standing intent up to `now`."""
        due = self._offset + int((now - self._start) / STEP + 1e-6)
        while due >= len(self._asked):
            self._asked = np.vstack([self._asked, np.zeros_like(self._asked)])
        if due > self._filled:
            self._asked[self._filled : due] = self._intent
            self._filled = due
