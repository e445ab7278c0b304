"""The hand that holds the phone: it lags, it trembles, and it cannot tilt as far as it likes."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from itertools import chain, repeat
from typing import Final

import numpy as np

TREMOR_HZ: Final = 10.0  # source: Lakie 2015: middle of the 8-12 Hz band of hand tremor
TREMOR: Final = 0.0043  # design: tremor in tasks with a device [rad]; phones have keys for these
MAX_TILT: Final = math.radians(45.0)  # design: the same [rad]
MAX_SPEED: Final = math.radians(200.0)  # design: the same [rad/s]


class Hand:
    """Angles of a held phone, away from how it is held at rest.

    The hand follows what it aims at with a first-order lag, no faster than `max_speed` and no
    farther than `max_tilt`. What it aims at is off by a share of itself that wanders within the
    lag (signal-dependent noise), and the whole trembles: a resonance around 10 Hz, driven by
    noise, that has 70 % of its power between 8 and 12 Hz. Both are exact for any length of a
    step, so that the rate of sampling changes nothing but where one looks.

    An accelerometer cannot tell the tilt of a tremor from its linear acceleration; `tremor`
    is both, as the tilt that would look the same.

    Args:
        lag: Time constant [s]; 0: it is where it aims at once.
        rng: Random generator of the hand.
        motor_noise: Standard deviation of the error of aiming, as a share of the tilt.
        tremor: Standard deviation of the apparent tilt on each axis [rad].
        max_tilt: Away from rest, each axis [rad].
        max_speed: Highest tilting speed, each axis [rad/s].
        tremor_width: Width of the tremor's resonance, between half-power frequencies [Hz].
        block: Number of steps whose random numbers are drawn at once; no effect on results.

    References:
        M. Lakie, C. A. Vernooij, C. J. Osler et al.: Increased gravitational force reveals the
        mechanical, resonant nature of physiological tremor. J. Physiology 593(19), 2015.
        C. M. Harris, D. M. Wolpert: Signal-dependent noise determines motor planning. Nature
        394, 1998.
    """

    def __init__(
        self,
        lag: float,
        rng: np.random.Generator,
        *,
        motor_noise: float = 0.0,
        tremor: float = TREMOR,
        max_tilt: float = MAX_TILT,
        max_speed: float = MAX_SPEED,
        tremor_width: float = 2.0,
        block: int = 256,
    ) -> None:
        self._lag = lag
        self._noise = motor_noise
        self._tremor = tremor
        self._max_tilt = max_tilt
        self._max_speed = max_speed
        self._damping = math.pi * tremor_width
        self._draws = _draws(rng, block)
        self._shake_pitch, self._shake_roll, self._off_pitch, self._off_roll = next(self._draws)
        self._pitch = self._roll = 0.0
        self._tuned: dict[float, tuple[float, float, float, complex, float]] = {}

    def rest(self) -> None:
        """Back to how it is held at rest, at once."""
        self._pitch = self._roll = 0.0

    def step(self, pitch: float, roll: float, dt: float) -> tuple[float, float]:
        """Return the phone's pose after `dt` [s] of aiming at `pitch` and `roll` [rad]."""
        keep, new, most, swing, drive = self._tuned.get(dt) or self._tune(dt)
        one, other, off_pitch, off_roll = next(self._draws)
        noise = self._noise
        if noise:
            self._off_pitch = off = self._off_pitch * keep + off_pitch * new
            pitch += pitch * noise * off
            self._off_roll = off = self._off_roll * keep + off_roll * new
            roll += roll * noise * off
        far = self._max_tilt
        pitch = -far if pitch < -far else far if pitch > far else pitch
        roll = -far if roll < -far else far if roll > far else roll
        turn = (pitch - self._pitch) * (1.0 - keep)
        self._pitch += -most if turn < -most else most if turn > most else turn
        turn = (roll - self._roll) * (1.0 - keep)
        self._roll += -most if turn < -most else most if turn > most else turn
        self._shake_pitch = one = self._shake_pitch * swing + one * drive
        self._shake_roll = other = self._shake_roll * swing + other * drive
        return self._pitch + self._tremor * one.real, self._roll + self._tremor * other.real

    def _tune(self, dt: float) -> tuple[float, float, float, complex, float]:
        """Return the factors that depend only on the length of a step; cached, as there are few."""
        keep = math.exp(-dt / self._lag) if self._lag > 0.0 else 0.0
        damping = self._damping
        swing = cmath.exp(complex(-damping, 2.0 * math.pi * TREMOR_HZ) * dt)
        drive = math.sqrt(1.0 - math.exp(-2.0 * damping * dt))
        if len(self._tuned) > 1000:
            self._tuned.clear()
        tuned = keep, math.sqrt(1.0 - keep * keep), self._max_speed * dt, swing, drive
        self._tuned[dt] = tuned
        return tuned


def _draws(rng: np.random.Generator, block: int) -> Iterator[tuple[complex, complex, float, float]]:
    """Yield the random drive of the tremor in pitch and roll, and the aiming errors, endlessly.

    All are standard normal, and the same ones whatever the block.
    """

    def drawn() -> Iterator[tuple[complex, complex, float, float]]:
        numbers = rng.normal(size=(block, 6))
        tremor = numbers[:, :4].copy().view(complex)
        return zip(*tremor.T.tolist(), *numbers[:, 4:].T.tolist(), strict=True)

    return chain.from_iterable(drawn() for _ in repeat(None))
