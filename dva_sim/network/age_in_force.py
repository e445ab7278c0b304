"""The age of the command in force, over time: one definition for drives, sockets and middleware.

A command that took effect is **in force** until a newer one takes effect, or until the robot drops
it as too old or its drive ends. At any moment its **age** is the time since it was made. Where
nothing is dropped, and before the first command, the age is the time since the run began.

References:
    S. Kaul, R. Yates, M. Gruteser: Real-time status: how often should one update? INFOCOM 2012.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class AgeInForce:
    """The age in force piece by piece; in each piece it grows as time does.

    Args:
        youngest: Age of each command when it took effect, or the time looked at began [s], shape
            `(n,)`.
        lengths: Time for which it was in force [s], shape `(n,)`.
    """

    def __init__(self, youngest: Floats, lengths: Floats) -> None:
        self._youngest = youngest
        self._lengths = lengths

    @classmethod
    def of_newest(
        cls, made: Floats, applied: Floats, *, start: float, since: float, until: float
    ) -> AgeInForce:
        """Return the age where nothing but a newer command replaces one.

        Args:
            made: Creation time of each command [s], shape `(n,)`, in the order of application.
            applied: Time of application [s], shape `(n,)`.
            start: Beginning of the run [s].
            since: Beginning of the time looked at [s].
            until: Its end [s].
        """
        origins = np.concatenate([[start], made])
        edges = np.clip(np.concatenate([[start], applied, [math.inf]]), since, until)
        lengths = np.diff(edges)
        is_seen = lengths > 0
        return cls((edges[:-1] - origins)[is_seen], lengths[is_seen])

    @property
    def mean(self) -> float:
        """Over time [s]; nan where nothing was in force."""
        total = float(self._lengths.sum())
        middle = self._youngest + self._lengths / 2
        return float((middle * self._lengths).sum() / total) if total else math.nan

    def share_above(self, age: float) -> float:
        """Share of the time in which it is above an age [s]."""
        oldest = self._youngest + self._lengths
        above = np.clip(oldest - np.maximum(self._youngest, age), 0.0, None)
        return float(above.sum() / self._lengths.sum())

    def quantile(self, share: float) -> float:
        """The age that is not exceeded in a share of the time [s]."""
        ages = np.unique(np.concatenate([self._youngest, self._youngest + self._lengths]))
        below = np.array([1.0 - self.share_above(age) for age in ages])
        return float(np.interp(share, below, ages))
