"""Differences adjusted for properties of persons and trials that are known before the runs.

It is known how cautious the drawn persons are and how long their ways, and also the average of
all persons. The excess of the sample over that average, times its effect on the difference (the
slope), is subtracted (control variates). The slope is estimated from the same persons. So persons
enter not with their means but with their jackknife pseudo-values, which include the uncertainty
of the slope: all intervals and bands are made of them as of means.

References:
    Lavenberg, Moeller & Welch, Oper. Res. 30 (1982) 182-202 (control variates for simulations);
    Nelson, Oper. Res. 38 (1990) 974-992 (where they fail, and jackknifing them).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.statistics.persons import Floats

MIN_EACH = 6
"""Persons for each number that is learned; with fewer the slopes cost more than they are worth."""
_DISTINCT = 1e-9  # relative size below which a covariate's own part counts as zero


def adjusted(means: ArrayLike, covariates: ArrayLike) -> Floats:
    """Return the persons' values whose mean is the adjusted one, level by level.

    A level with too few persons stays as it is, and so does one whose covariates do not vary.

    Args:
        means: Means of the persons `(n, k)`, nan where missing.
        covariates: Means of the same trials `(p, n, k)`, of which each has a true mean of zero.

    Returns:
        Pseudo-values `(n, k)`, nan where the means are.
    """
    values = np.array(means, dtype=float)
    beside = np.asarray(covariates, dtype=float)
    for level in range(values.shape[1]):
        is_finite = np.isfinite(values[:, level]) & np.isfinite(beside[:, :, level]).all(axis=0)
        if len(beside) and is_finite.sum() >= MIN_EACH * (1 + len(beside)):
            pseudo_values = _pseudo_values(values[is_finite, level], beside[:, is_finite, level].T)
            values[:, level] = np.nan
            values[is_finite, level] = pseudo_values
    return values


def _pseudo_values(values: Floats, covariates: Floats) -> Floats:
    """Return the jackknife the constant of a regression on covariates `(n, p)`.

    Values as given if singular.

    Leaving a person out changes the constant by what its residual weighs in it.
    """
    n = len(values)
    design = np.column_stack([np.ones(n), covariates])
    inverse = np.linalg.pinv(design, rcond=_DISTINCT)
    residual = values - design @ (inverse @ values)
    leverage = np.einsum("ij,ji->i", design, inverse)  # how much of each fitted value is its own
    if (leverage > 1 - _DISTINCT).any():
        return values
    constant = float((inverse @ values)[0])
    return np.asarray(constant + (n - 1) * inverse[0] * residual / (1 - leverage))


def off_zero(covariate: ArrayLike) -> float:
    """Return how many standard errors the mean of a covariate `(n,)` is off its true zero."""
    values = np.asarray(covariate, dtype=float)
    values = values[np.isfinite(values)]
    if len(values) < 2 or not np.ptp(values) > 0:
        return 0.0 if not values.any() else np.inf
    return float(abs(values.mean()) / (values.std(ddof=1) / np.sqrt(len(values))))
