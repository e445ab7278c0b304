"""Several levels at once: means over persons with a band that holds all of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.persons import (
    LEVEL,
    RESAMPLES,
    Floats,
    draws,
    students_t,
)

_FEWEST_TO_RESAMPLE = 6  # below, 5 % of the draws repeat one person only and have no spread
_LEAST_ERROR = 0.25  # of the sample's standard error, in any draw
_ROUNDING = 1e-12  # spread below this share of the values is rounding, not variation


@dataclass(frozen=True)
class Band:
    """Means at `k` levels, with intervals for each level alone and for all of them at once.

    Attributes:
        mean: Means over persons `(k,)`; nan where nobody has a value.
        low: Lower edge of the simultaneous band `(k,)`; nan with fewer than two persons.
        high: Its upper edge `(k,)`.
        pointwise_low: Lower end of each level's own interval `(k,)`.
        pointwise_high: Its upper end `(k,)`.
        critical: Standard errors between the mean and the band's edge.
        n_persons: How many persons have at least one value.
    """

    mean: Floats
    low: Floats
    high: Floats
    pointwise_low: Floats
    pointwise_high: Floats
    critical: float
    n_persons: int


def band(
    differences: ArrayLike, level: float = LEVEL, seed: int = 1, resamples: int = RESAMPLES
) -> Band:
    """A band that holds all levels at once with the given confidence.

    Its width comes from the largest studentised deviation over the levels when persons are
    drawn anew: that respects how the levels depend on each other and how skewed they are.
    A draw that happens to repeat the same few persons has next to no spread of its own;
    it is given at least a quarter of the sample's. Without that a level at which most
    persons do not differ at all makes the band endless; with it the 95 % band holds in 92
    to 97 % of studies of 6 to 24 persons, normal, skewed (skewness 2.3) or four fifths
    zero. With fewer than 6 persons Bonferroni's t stands in.

    Args:
        differences: One row per person `(n_persons, k)`, nan where a cell is missing.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.

    References:
        Efron & Tibshirani, An Introduction to the Bootstrap (1993), section 12.5 (bootstrap-t);
        Westfall & Young, Resampling-Based Multiple Testing (1993), section 2.2 (max-t).
    """
    values = np.atleast_2d(np.asarray(differences, dtype=float))
    values = values[np.isfinite(values).any(axis=1)]
    mean, error, count = (x[0] for x in _moments(values, np.ones((1, len(values)))))
    judged = error > 0  # neither nan nor without spread
    ratio = _studentised(values[:, judged], mean[judged], error[judged], seed, resamples)
    alone = np.array([students_t(level, int(n)) for n in count])
    alone[judged] = _alone(ratio, count[judged], level)
    critical = _together(ratio, count[judged], level)
    low, high = mean - critical * error, mean + critical * error
    return Band(mean, low, high, mean - alone * error, mean + alone * error, critical, len(values))


def _studentised(values: Floats, mean: Floats, error: Floats, seed: int, resamples: int) -> Floats:
    """How many standard errors a mean of persons drawn anew is off `(resamples, k)`."""
    if not len(mean):
        return np.empty((0, 0))
    drawn, drawn_error, _ = _moments(values, draws(len(values), seed, resamples))
    return np.asarray(abs(drawn - mean) / np.maximum(drawn_error, _LEAST_ERROR * error))


def _alone(ratio: Floats, count: Floats, level: float) -> list[float]:
    """Standard errors that hold each level by itself; never less than Student's."""
    largest = np.nanquantile(ratio, level, axis=0) if ratio.size else np.zeros(len(count))
    pairs = zip(largest, count, strict=True)
    return [max(_trusted(x, int(n)), students_t(level, int(n))) for x, n in pairs]


def _trusted(resampled: float, persons: int) -> float:
    return resampled if persons >= _FEWEST_TO_RESAMPLE else 0.0


def _together(ratio: Floats, count: Floats, level: float) -> float:
    """Standard errors that hold all levels at once; never less than the widest one alone."""
    if not len(count):
        return math.nan
    fewest = int(count.min())
    if fewest < _FEWEST_TO_RESAMPLE:
        return students_t(1 - (1 - level) / len(count), fewest)
    largest = np.quantile(ratio.max(axis=1), level, method="inverted_cdf")
    return max(float(largest), students_t(level, fewest))


def _moments(values: Floats, weights: Floats) -> tuple[Floats, Floats, Floats]:
    """Mean, standard error and count per level `(b, k)` for rows weighted `(b, n)`."""
    there = np.isfinite(values)
    filled = np.where(there, values, 0.0)
    count = weights @ there
    nobody, few = count < 1, count < 2
    centre = filled.sum(axis=0) / np.maximum(there.sum(axis=0), 1)
    off = np.where(there, values - centre, 0.0)  # centred first: squares keep their digits
    mean = np.where(nobody, np.nan, (weights @ off) / np.maximum(count, 1))
    square = (weights @ off**2) / np.maximum(count, 1)
    variance = np.where(few, np.nan, (square - mean**2) / np.maximum(count - 1, 1))
    tiny = (_ROUNDING * (abs(centre) + abs(off).max(axis=0, initial=0.0))) ** 2
    error = np.sqrt(np.where(variance <= tiny, 0.0, variance))
    return mean + centre, error, count
