"""Differences adjusted for properties of persons and trials that are known before the runs.

Before the runs, the caution of the drawn persons and the lengths of their routes are known, and so
are the averages over all persons. The excess of the sample over these averages, times its effect on
the difference (the slope), is subtracted (control variates). As the slope is estimated from the
same persons, their means are replaced by jackknife pseudo-values, which include the uncertainty of
the slope. Intervals and bands are computed from them as from means.

References:
    Lavenberg, Moeller & Welch, Oper. Res. 30 (1982) 182-202 (control variates for simulations);
    Nelson, Oper. Res. 38 (1990) 974-992 (where they fail, and jackknifing them).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.statistics.persons import Floats

MIN_EACH = 6
"""Minimum persons per estimated slope; with fewer, it adds more variance than it saves."""
_DISTINCT = 1e-9  # relative size below which a covariate counts as a combination of others


def adjusted(means: ArrayLike, covariates: ArrayLike) -> Floats:
    """Return values of the persons whose mean is the adjusted mean, level by level.

    A level with too few persons is not adjusted, nor is one whose covariates do not vary.

    Args:
        means: Means of the persons `(n, k)`, nan where missing.
        covariates: Means of each covariate over the same trials `(p, n, k)`; true mean zero.

    Returns:
        Pseudo-values `(n, k)`, nan where the means are nan.
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
    """Return jackknife pseudo-values of the constant in a regression on covariates `(n, p)`.

    If the regression is singular, return the values unchanged. Leaving out a person changes the
    constant by the person's residual times its weight.
    """
    n = len(values)
    design = np.column_stack([np.ones(n), covariates])
    inverse = np.linalg.pinv(design, rcond=_DISTINCT)
    residual = values - design @ (inverse @ values)
    leverage = np.einsum("ij,ji->i", design, inverse)  # weight of each value in its own fit
    if (leverage > 1 - _DISTINCT).any():
        return values
    constant = float((inverse @ values)[0])
    return np.asarray(constant + (n - 1) * inverse[0] * residual / (1 - leverage))


def off_zero(covariate: ArrayLike) -> float:
    """Return the deviation of a covariate's mean from its true zero in standard errors."""
    values = np.asarray(covariate, dtype=float)
    values = values[np.isfinite(values)]
    if len(values) < 2 or not np.ptp(values) > 0:
        return 0.0 if not values.any() else np.inf
    return float(abs(values.mean()) / (values.std(ddof=1) / np.sqrt(len(values))))
