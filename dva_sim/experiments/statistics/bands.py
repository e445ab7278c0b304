"""Several levels at once: means over persons with a band that holds all of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.persons import LEVEL, RESAMPLES, Floats, students_t
from dva_sim.experiments.statistics.studentised import (
    FEWEST_TO_RESAMPLE,
    moments,
    place,
    reach,
    studentised,
)


@dataclass(frozen=True)
class Band:
    """Means at `k` levels, with intervals for each level alone and for all of them at once.

    Attributes:
        mean: Means over persons `(k,)`; nan where nobody has a value.
        low: Lower edge of the simultaneous band `(k,)`; nan with fewer than two persons.
        high: Its upper edge `(k,)`.
        pointwise_low: Lower end of each level's own interval `(k,)`.
        pointwise_high: Its upper end `(k,)`.
        critical: Standard errors between each mean and the band's edge `(k,)`, if the level's
            own interval does not end farther out; nan where there is no spread to measure by.
        n_persons: How many persons have at least one value.
    """

    mean: Floats
    low: Floats
    high: Floats
    pointwise_low: Floats
    pointwise_high: Floats
    critical: Floats
    n_persons: int


def band(
    differences: ArrayLike, level: float = LEVEL, seed: int = 1, resamples: int = RESAMPLES
) -> Band:
    """A band that holds all levels at once with the given confidence.

    Its width comes from the largest studentised deviation over the levels when persons are
    drawn anew: that respects how the levels depend on each other and how skewed they are.
    Nowhere does it end inside a level's own interval. A level with fewer than 6 persons gets
    Bonferroni's t, and the others share what it leaves of the chance to err.

    Args:
        differences: One row per person `(n_persons, k)`, nan where a cell is missing.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.

    References:
        Westfall & Young, Resampling-Based Multiple Testing (1993), section 2.2 (max-t).
    """
    values = np.atleast_2d(np.asarray(differences, dtype=float))
    values = values[np.isfinite(values).any(axis=1)]
    mean, error, count = (x[0] for x in moments(values, np.ones((1, len(values)))))
    judged = error > 0  # neither nan nor without spread
    ratio = studentised(values[:, judged], mean[judged], error[judged], seed, resamples)
    down, up = np.where(count > 1, 0.0, np.nan), np.where(count > 1, 0.0, np.nan)
    down[judged], up[judged] = reach(ratio, count[judged], level)
    critical = np.full(len(mean), np.nan)
    critical[judged] = _critical(ratio, count[judged], level)
    reached = np.where(judged, critical, 0.0) * error
    lowest, highest = mean - down * error, mean + up * error
    low, high = np.minimum(mean - reached, lowest), np.maximum(mean + reached, highest)
    return Band(mean, low, high, lowest, highest, critical, len(values))


def _critical(ratio: Floats, count: Floats, level: float) -> Floats:
    """Standard errors `(k,)` that hold all levels at once; never less than the widest one alone."""
    each = (1 - level) / max(len(count), 1)
    critical = np.array([students_t(1 - each, int(n)) for n in count])
    many = count >= FEWEST_TO_RESAMPLE
    if many.any():
        together = 1 - each * many.sum()
        largest = np.sort(abs(ratio[:, many]).max(axis=1))[place(len(ratio), together)]
        critical[many] = max(float(largest), students_t(together, int(count[many].min())))
    return critical
