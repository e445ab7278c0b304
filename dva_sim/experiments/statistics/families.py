"""Several tests of one family: the chance of any false alarm is kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.persons import Floats


def holm(p_values: ArrayLike, family: ArrayLike | None = None) -> Floats:
    """P-values adjusted for their number by Holm's step-down procedure.

    A test is significant at a level, together with all others of its family, where its
    adjusted value is not above that level.

    Args:
        p_values: Of each test `(m,)`; nan where a test could not be made, which counts not.
        family: Which declared family each test is of `(m,)`; all of one if left out.

    Returns:
        Adjusted p-values `(m,)`, at most 1; nan stays nan.

    References:
        Holm, Scand. J. Stat. 6 (1979) 65-70.
    """
    values = np.asarray(p_values, dtype=float)
    families = np.zeros(len(values)) if family is None else np.asarray(family)
    adjusted = np.full(len(values), np.nan)
    for name in np.unique(families):
        ours = (families == name) & ~np.isnan(values)
        adjusted[ours] = _adjusted(values[ours])
    return adjusted


def _adjusted(values: Floats) -> Floats:
    order = np.argsort(values, kind="stable")
    stepped = np.arange(len(values), 0, -1) * values[order]
    found = np.empty(len(values))
    found[order] = np.minimum(1.0, np.maximum.accumulate(stepped))
    return found
