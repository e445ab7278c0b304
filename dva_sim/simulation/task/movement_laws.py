"""Laws and measures of movement in the literature: pointing, steering and tracking.

References:
    I. S. MacKenzie: Fitts' law as a research and design tool in human-computer interaction.
    Human-Computer Interaction 7, 1992 (Shannon form, effective width).
    R. W. Soukoreff, I. S. MacKenzie: Towards a standard for pointing device evaluation. Int. J.
    Human-Computer Studies 61, 2004 (throughput).
    J. Accot, S. Zhai: Beyond Fitts' law: models for trajectory-based HCI tasks. CHI 1997.
    D. T. McRuer et al.: Human pilot dynamics in compensatory systems. AFFDL-TR-65-15, 1965.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

WIDTH_PER_SD = 4.133  # effective width per standard deviation: the middle 96 % of a normal law


def fitts_id(amplitude: float, width: float) -> float:
    """Index of difficulty in the Shannon form [bit]."""
    return math.log2(amplitude / width + 1.0)


def steering_id(length: float, width: float) -> float:
    """Index of difficulty of a tunnel of constant width: how many widths it is long."""
    return length / width


def effective_width(ends: Sequence[float]) -> float:
    """Return the width that 96 % of the end points would fill [m]; ends along the task axis [m]."""
    return WIDTH_PER_SD * float(np.std(ends, ddof=1))


def throughput(
    amplitude: float, width: float, times: Sequence[float], ends: Sequence[float] | None = None
) -> float:
    """Return bits per second over the trials of one condition.

    Args:
        amplitude: Nominal way to the target [m].
        width: Nominal width [m]; stands where no `ends` are given.
        times: Movement times [s].
        ends: End positions of the trials along the task axis, from the centre of the target [m]:
            the index then rests on the effective width and the amplitude actually covered.

    Returns:
        nan without trials, or if all trials ended at the same place.
    """
    if not len(times):
        return math.nan
    if ends is not None:
        if len(ends) < 2 or not (width := effective_width(ends)):
            return math.nan
        amplitude += float(np.mean(ends))
    return fitts_id(amplitude, width) / float(np.mean(times))


class FittedLine(NamedTuple):
    """A straight line fitted by least squares, and the share of variance that it explains."""

    intercept: float
    slope: float
    r2: float


def fit_line(x: Sequence[float] | Floats, y: Sequence[float] | Floats) -> FittedLine:
    """Return the least-squares line through points.

    Raises:
        ValueError: fewer than two different x.
    """
    xs = np.asarray(x, float)
    ys = np.asarray(y, float)
    if len(np.unique(xs)) < 2:
        raise ValueError("a line needs two different x")
    slope, intercept = np.polyfit(xs, ys, 1)
    rest = ys - (intercept + slope * xs)
    total = float(((ys - ys.mean()) ** 2).sum())
    r2 = 1.0 - float((rest**2).sum()) / total if total else 1.0
    return FittedLine(float(intercept), float(slope), r2)


class Crossover(NamedTuple):
    """Crossover of the open loop: frequency [rad/s] and phase margin [rad] at a gain of one."""

    frequency: float
    phase_margin: float


def open_loop(
    target: Floats, cursor: Floats, dt: float, frequencies: Sequence[float]
) -> NDArray[np.complex128]:
    """Return the cursor over error at the frequencies of the forcing function.

    The record must hold a whole number of periods of each, so that none leaks into another.

    Args:
        target: `(n,)` [m].
        cursor: `(n,)` [m].
        dt: Between samples [s].
        frequencies: `(k,)` [rad/s].

    Returns:
        `(k,)`, the describing function of operator and plant together.
    """
    times = np.arange(len(target)) * dt
    waves = np.exp(-1j * np.outer(frequencies, times))
    error = waves @ (target - cursor)
    return np.asarray(waves @ cursor / error)


def crossover(frequencies: Sequence[float], loop: NDArray[np.complex128]) -> Crossover:
    """Read crossover frequency and phase margin off a measured open loop.

    Between the two frequencies around the crossover the gain is straight in log over log, and the
    phase in log frequency, the shorter way round. Of the phase nothing else counts: the lowest
    sines, of whose periods a record holds few, are the noisiest. Where the gain is below one
    everywhere, or nowhere, there is nan.

    Returns:
        The margin is within (-pi, pi]: whole turns cannot be told.
    """
    log_w = np.log(np.asarray(frequencies))
    gain = np.log(np.abs(loop))
    falls = np.flatnonzero((gain[:-1] >= 0.0) & (gain[1:] < 0.0))
    if not len(falls):
        return Crossover(math.nan, math.nan)
    i = int(falls[0])
    share = gain[i] / (gain[i] - gain[i + 1])
    at = log_w[i] + share * (log_w[i + 1] - log_w[i])
    angle = float(np.angle(loop[i]) + share * np.angle(loop[i + 1] / loop[i]))
    return Crossover(float(np.exp(at)), math.pi - (-angle) % (2.0 * math.pi))


def first_peak(values: Sequence[float], falls: float = 0.1) -> int:
    """Return where the first rise of a signal ends: before it falls by a share of its height.

    Args:
        values: Smoothed values of the signal.
        falls: Share; a shorter fall is noise.
    """
    best = 0
    height = 0.0
    largest = max(values)
    for index, value in enumerate(values):
        if value > height:
            best = index
            height = value
        elif height > SMALL * largest and value < (1.0 - falls) * height:
            break
    return best


SMALL = 0.2  # share of the largest peak below which a peak does not count


def first_above(values: Sequence[float], level: float) -> int:
    """Return where a signal first exceeds a level; its length if it never does."""
    return next((n for n, value in enumerate(values) if value > level), len(values))
