"""From batches to an estimate with its standard error, sharper by what is known of the luck.

A run is cut into batches, long enough to be almost independent; a measure is a sum over a sum
(waits over customers), batch by batch. Its error comes from how much the batches differ.

**Control variates.** Some batches wait long because many came, or because looking took long.
How many came and how long looking takes *on average* is known: it is in the scenario. So what
is explained by the luck of the inputs can be taken off, and much smaller errors remain. The
weights come from regression, on *other* batches than the ones they are used on: what is taken
off a batch has mean zero whatever the weights are, so nothing is biased. But a wrong *input*
would be taken off too, and a control whose mean comes from a wrong formula would hide that it
is wrong. Therefore the means and shapes of the inputs are checks of their own, and the
estimate *without* controls has to agree as well.

References:
    S. S. Lavenberg & P. D. Welch, Manage. Sci. 27 (1981) 322-335 (control variates);
    A. N. Avramidis & J. R. Wilson, Oper. Res. Lett. 14 (1993) 187-198 (splitting: weights from
    other batches); W. G. Cochran, Sampling Techniques, 3rd ed. (1977), chapter 6 (ratios).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
CheckVerdict = Literal["agrees", "too rough", "differs"]

ERRORS = 3.0  # an estimate may be so many standard errors off
TOLERANCE = 0.005  # or so much, as a share of the exact value
PRECISION = 0.01  # standard error asked for, as a share of the exact value
MANY = 100  # batches whose own spread is known well enough
_FOLDS = 10
_BATCHES_PER_CONTROL = 5  # with fewer, weights are noise
_ROUNDING = 1e-9  # what arithmetic alone may cost


@dataclass(frozen=True)
class Estimate:
    """A measure, with and without what is known of the luck.

    Attributes:
        value: The estimate.
        error: Its standard error.
        plain: The same without control variates.
        plain_error: Its standard error.
        batches: How many batches it rests on.
    """

    value: float
    error: float
    plain: float
    plain_error: float
    batches: int


def estimate(tops: Floats, bottoms: Floats, controls: Floats | None = None) -> Estimate:
    """The ratio of two sums over batches.

    Args:
        tops: Such as the sum of waits in each batch `(n,)`.
        bottoms: Such as the number of customers in each batch `(n,)`.
        controls: What is known to have mean zero, one row per batch `(n, k)`.
    """
    total = float(bottoms.sum())
    if not total:
        return Estimate(math.nan, math.nan, math.nan, math.nan, len(tops))
    plain = float(tops.sum()) / total
    off = (tops - plain * bottoms) / (total / len(bottoms))  # linearised: mean zero
    left = off if controls is None else adjusted(off, controls)
    return Estimate(plain + float(left.mean()), _error(left), plain, _error(off), len(tops))


def certain(value: float) -> Estimate:
    """A value that nothing is left to chance in."""
    return Estimate(float(value), 0.0, float(value), 0.0, 1)


def adjusted(values: Floats, controls: Floats) -> Floats:
    """The values without what the controls explain, by weights from other batches.

    Args:
        values: One per batch `(n,)`.
        controls: With mean zero, the most telling first `(n, k)`; those there are too few
            batches for are left out.
    """
    spread = controls.std(axis=0)
    useful = controls[:, spread > _ROUNDING * (abs(controls).max(axis=0) + _ROUNDING)]
    useful = useful[:, : len(values) // _BATCHES_PER_CONTROL]
    if not useful.shape[1]:
        return values
    useful = useful / useful.std(axis=0)
    left = np.empty_like(values)
    for fold in np.array_split(np.arange(len(values)), _FOLDS):
        others = np.ones(len(values), dtype=bool)
        others[fold] = False
        around = np.column_stack([np.ones(others.sum()), useful[others]])
        weights = np.linalg.lstsq(around, values[others], rcond=None)[0][1:]
        left[fold] = values[fold] - useful[fold] @ weights
    return left


def verdict(found: Estimate, exact: float, precision: float | None = PRECISION) -> CheckVerdict:
    """Whether an estimate agrees with the exact value.

    Args:
        found: The estimate.
        exact: What it should be.
        precision: Standard error asked for, as a share of the exact value; None asks for none.

    Returns:
        `differs`: further off than 3 standard errors (as many more as Student's t asks for
        with few batches) and than 0.5 %, with controls or without them. `too rough`: the
        standard error is above what is asked for, so that agreement says little.
    """
    rounding = _ROUNDING * max(1.0, abs(exact))
    errors = _errors_allowed(found.batches)
    for value, error in ((found.value, found.error), (found.plain, found.plain_error)):
        if not abs(value - exact) <= max(errors * error, TOLERANCE * abs(exact), rounding):
            return "differs"
    if precision is not None and not found.error <= max(precision * abs(exact), rounding):
        return "too rough"
    return "agrees"


@cache
def _errors_allowed(batches: int) -> float:
    """Standard errors that a right estimate from so many batches may be off."""
    if not 1 < batches < MANY:
        return ERRORS
    from scipy import special

    return float(special.stdtrit(batches - 1, 1 - math.erfc(ERRORS / math.sqrt(2)) / 2))


def expected_alarms(checks: int) -> float:
    """How many of so many right checks differ all the same, on average, at most.

    Each may by either of its two estimates.
    """
    return 2 * checks * math.erfc(ERRORS / math.sqrt(2))


def _error(values: Floats) -> float:
    """Standard error of a mean; nan with fewer than two values."""
    if len(values) < 2:
        return math.nan
    error = float(values.std(ddof=1)) / math.sqrt(len(values))
    return error if error > 1e-14 * float(abs(values).max()) else 0.0
