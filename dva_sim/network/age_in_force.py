"""Age of the command in force: one definition for models, sockets and middleware.

A command is **applied** if it arrives before all newer ones: a robot drops older ones. The command
**in force** is the one applied last, until the robot drops it as too old or its drive ends. Its age
is the time since it was made; before the first one, it is the time since the run began.

References:
    S. Kaul, R. Yates, M. Gruteser: Real-time status: how often should one update? INFOCOM 2012.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_TIE_S = 1e-6  # commands that arrive within this time before a moment are not seen yet [s]


def is_applied(made: ArrayLike) -> NDArray[np.bool_]:
    """Return which commands are newer than all before them, shape `(n,)`.

    Args:
        made: Creation time of each [s], or its number, in the order of arrival; shape `(n,)`.
    """
    newest = np.maximum.accumulate(np.append(-math.inf, made))
    return np.asarray(newest[1:] > newest[:-1])


class AgeInForce:
    """The age in force over time, piece by piece; in each it grows as time does.

    Args:
        made: Creation time of each command [s], in the order of arrival; shape `(n,)`.
        arrived: Time of its arrival [s], shape `(n,)`.
        start: Beginning of the run [s].
    """

    def __init__(self, made: Floats, arrived: Floats, start: float) -> None:
        used = is_applied(made)
        self._made = np.append(start, made[used])
        self._arrived = np.append(-math.inf, arrived[used])

    def at(self, moments: Floats) -> Floats:
        """Return the age at each moment [s], not before the first command; shape `(m,)`.

        A command that arrives at the very moment is not seen: real programs are never early, and
        where commands keep step with the moments a tie would be worth a whole step.
        """
        newest = np.searchsorted(self._arrived + _TIE_S, moments) - 1
        return np.asarray(moments - self._made[newest])

    def over(self, since: float, until: float) -> AgesOverTime:
        """Return the ages within a window [s]."""
        edges = np.clip(np.append(self._arrived, math.inf), since, until)
        lengths = np.diff(edges)
        is_seen = lengths > 0
        return AgesOverTime((edges[:-1] - self._made)[is_seen], lengths[is_seen])


class AgesOverTime:
    """The ages in force piece by piece; in each they grow as time does.

    Args:
        youngest: Age of each command when it came into force, or the window began [s], shape
            `(n,)`.
        lengths: Time for which it was in force [s], shape `(n,)`.
    """

    def __init__(self, youngest: Floats, lengths: Floats) -> None:
        self._youngest = youngest
        self._lengths = lengths

    @property
    def mean(self) -> float:
        """Mean over time [s]; nan if nothing was in force."""
        total = float(self._lengths.sum())
        middles = self._youngest + self._lengths / 2
        return float((middles * self._lengths).sum() / total) if total else math.nan

    def share_above(self, age: float) -> float:
        """Return the share of the time in which the age is above a limit [s]."""
        oldest = self._youngest + self._lengths
        above = np.clip(oldest - np.maximum(self._youngest, age), 0.0, None)
        return float(above.sum() / self._lengths.sum())

    def quantile(self, share: float) -> float:
        """Return the age that is not exceeded in a share of the time [s]."""
        ages = np.unique(np.concatenate([self._youngest, self._youngest + self._lengths]))
        below = np.array([1.0 - self.share_above(age) for age in ages])
        return float(np.interp(share, below, ages))
