"""Morris's screening: the size and sign of the effects of many factors, from few runs.

References:
    M. D. Morris: Factorial sampling plans for preliminary computational experiments. Technometrics
    33 (1991) 161-174.
    F. Campolongo, J. Cariboni, A. Saltelli: An effective screening design for sensitivity analysis
    of large models. Environmental Modelling & Software 22 (2007) 1509-1518 (the mean of absolute
    values).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dva_sim.statistics.bands import band
from dva_sim.statistics.persons import Floats, Interval

GRID = 4  # values of each factor: 0, 1/3, 2/3 and 1 of its band
STEP = GRID / (2.0 * (GRID - 1))  # step of a factor, as a share of its band


def trajectories(axes: int, count: int, rng: np.random.Generator) -> Floats:
    """Draw walks through the unit cube `(count, axes + 1, axes)`, changing a factor per step."""
    walks = np.empty((count, axes + 1, axes))
    for walk in walks:
        low = rng.integers(0, GRID // 2, axes) / (GRID - 1)
        up = rng.random(axes) < 0.5
        walk[:] = np.where(up, low, low + STEP)
        for step, axis in enumerate(rng.permutation(axes), 1):
            walk[step:, axis] = low[axis] + STEP if up[axis] else low[axis]
    return walks


@dataclass(frozen=True)
class ElementaryEffects:
    """Effects of one factor, each over its whole band, at different values of the other factors.

    Attributes:
        mean: Mean effect, with its interval over trajectories; the sign is the direction.
        size: Mean of the absolute effects, which do not cancel if their signs differ.
        spread: Standard deviation of the effects: interactions, curvature and remaining noise.
    """

    mean: Interval
    size: float
    spread: float


def elementary_effects(walks: Floats, outcome: NDArray[np.float64]) -> list[ElementaryEffects]:
    """Return effects of each factor on an outcome.

    Args:
        walks: See `trajectories`.
        outcome: Outcome at each point `(count, axes + 1)`; nan where missing.
    """
    changes = np.diff(walks, axis=1)
    axis_of_step = abs(changes).argmax(axis=2)
    signs = np.sign(np.take_along_axis(changes, axis_of_step[..., None], axis=2)[..., 0])
    slopes = signs * np.diff(outcome, axis=1) / STEP
    effects = np.empty_like(slopes)
    np.put_along_axis(effects, axis_of_step, slopes, axis=1)
    effect_band = band(effects)
    counts = np.isfinite(effects).sum(axis=0)
    ends = zip(
        effect_band.mean,
        effect_band.pointwise_low,
        effect_band.pointwise_high,
        counts,
        strict=True,
    )
    means = [Interval(float(m), float(low), float(high), int(n)) for m, low, high, n in ends]
    sizes = np.nanmean(abs(effects), axis=0)
    spreads = np.nanstd(effects, axis=0, ddof=1)
    return [
        ElementaryEffects(mean, float(size), float(spread))
        for mean, size, spread in zip(means, sizes, spreads, strict=True)
    ]
