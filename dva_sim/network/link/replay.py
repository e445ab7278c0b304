"""A delay log played back: what its probes met, a link's packets meet at the same times."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np
from numpy.typing import NDArray

from dva_sim.network.link.delay_logs import DelayLog
from dva_sim.network.link.recorded import Floats

Flags = NDArray[np.bool_]


class Replay:
    """One direction's part of a log, over and over; each packet meets the probe nearest in time.

    While the nearest probe is a lost one, every packet is lost: the log knows no finer.

    Args:
        share: Share of each delay that this direction takes.
        here: True for lost probes that were lost in this direction, shape `(n,)`.
        offset: Place in the log at which the run begins [s].
    """

    def __init__(self, log: DelayLog, share: float, here: Flags, offset: float) -> None:
        times = log.times - log.times[0]
        self._period = find_period(log)
        self._ends = (0.5 * (times + np.append(times[1:], self._period))).tolist()
        self._delays = _filled(share * log.delays).tolist()
        self._lost = (np.isnan(log.delays) & here).tolist()
        self._offset = offset

    def deviation(self, now: float) -> float:
        """Implement `Wobble`."""
        return float(self._delays[self._at(now)])

    def takes(self, now: float, left_at: float) -> bool:
        """Implement `Fate`."""
        return bool(self._lost[self._at(now)])

    def _at(self, now: float) -> int:
        index = bisect_right(self._ends, (now + self._offset) % self._period)
        return index if index < len(self._ends) else 0  # nearer to where the log begins again


def find_period(log: DelayLog) -> float:
    """Return the period after which a log repeats [s]: a typical step after its last probe."""
    steps = np.diff(log.times)
    return float(log.times[-1] - log.times[0] + np.median(steps[steps > 0]))


def compute_moments(log: DelayLog) -> tuple[float, float]:
    """Mean and standard deviation of the delays of a log [s]."""
    return float(np.nanmean(log.delays)), float(np.nanstd(log.delays))


def _filled(delays: Floats) -> Floats:
    """Return the delays, with the last known one in place of each lost probe."""
    measured = np.flatnonzero(~np.isnan(delays))
    last = np.searchsorted(measured, np.arange(len(delays)), side="right") - 1
    return delays[measured[np.maximum(last, 0)]]
