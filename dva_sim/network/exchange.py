"""What an operator and a robot did in one run, and the results that are computed from it.

Sockets and model fill the same record, so that a result means the same on both sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dva_sim.network.condition import RESULTS, STALE_STEP_S, Condition

Result = float | int | None
Floats = NDArray[np.float64]


@dataclass
class Exchange:
    """The times of one run by one clock [s].

    Attributes:
        opened: The operator began to connect.
        start: The first command was due: the first issue, or `opened` where nobody waits.
        connected: The operator's connection stood; None where nobody waited for it.
        handshake: The operator's handshake was done; None where nobody waited for it.
        issued: When command 0, 1, 2, ... was issued; a repetition is no new command.
        applied: Command and end of its processing, in the order of time.
        replies: Command and arrival of its reply.
        timeouts: Attempts that had no reply in time.
        alerts: Commands that were given up.
    """

    opened: float = 0.0
    start: float = 0.0
    connected: float | None = None
    handshake: float | None = None
    issued: list[float] = field(default_factory=list)
    applied: list[tuple[int, float]] = field(default_factory=list)
    replies: list[tuple[int, float]] = field(default_factory=list)
    timeouts: list[float] = field(default_factory=list)
    alerts: list[float] = field(default_factory=list)

    def results(self, condition: Condition) -> dict[str, Result]:
        """The columns `RESULTS` over the window [start + warm, start + warm + dur)."""
        begin = self.start + condition.warm_s
        window = (begin, begin + condition.dur_s)
        applied = [item for item in self.applied if _within(item[1], window)]
        row: dict[str, Result] = dict.fromkeys(RESULTS)
        row |= self._counts(condition, window, applied)
        row |= _spread("age", self._ages(applied))
        row |= _spread("rtt", self._ages([r for r in self.replies if _within(r[1], window)]))
        row |= _spread("stale", self._stale(window))
        gaps = 1e3 * np.diff([window[0], *(at for _, at in applied), window[1]])
        row |= {"gap_p95": float(np.percentile(gaps, 95)), "gap_max": float(gaps.max())}
        for name, at in (("t_conn_ms", self.connected), ("t_hs_ms", self.handshake)):
            row[name] = None if at is None else 1e3 * (at - self.opened)
        if condition.pattern == "req":
            row["timeouts"] = sum(_within(at, window) for at in self.timeouts)
            row["alerts"] = sum(_within(at, window) for at in self.alerts)
        return row

    def _counts(
        self, condition: Condition, window: tuple[float, float], applied: list[tuple[int, float]]
    ) -> dict[str, Result]:
        sent = [seq for seq, at in enumerate(self.issued) if _within(at, window)]
        distinct = len({seq for seq, _ in applied})
        ever = {seq for seq, _ in self.applied}
        overtaken = [seq for seq in sent if ever and seq <= max(ever)]
        skipped = sum(seq not in ever for seq in overtaken)
        return {
            "n_sent": len(sent),
            "n_applied": len(applied),
            "n_distinct": distinct,
            "send_hz": len(sent) / condition.dur_s,
            "applied_hz": len(applied) / condition.dur_s,
            "dup": len(applied) - distinct,
            "skip_frac": skipped / len(overtaken) if overtaken else None,
            "first_seq": min(ever, default=None),
        }

    def _ages(self, items: Sequence[tuple[int, float]]) -> Floats:
        """Time since the first issue of each item's command [ms], shape `(n,)`."""
        return np.array([1e3 * (at - self.issued[seq]) for seq, at in items])

    def _stale(self, window: tuple[float, float]) -> Floats:
        """Age of the command applied last, looked at in regular steps [ms], shape `(n,)`.

        Before any was applied it counts from the start.
        """
        steps = round((window[1] - window[0]) / STALE_STEP_S)
        looks = window[0] + STALE_STEP_S * np.arange(steps)
        ends = np.array([at for _, at in self.applied])
        issues = np.array([self.start, *(self.issued[seq] for seq, _ in self.applied)])
        ages: Floats = 1e3 * (looks - issues[np.searchsorted(ends, looks, side="right")])
        return ages


def _within(at: float, window: tuple[float, float]) -> bool:
    return window[0] <= at < window[1]


def _spread(name: str, values: Floats) -> dict[str, Result]:
    if not values.size:
        return {}
    p50, p95, p99 = (float(value) for value in np.percentile(values, (50, 95, 99)))
    return {
        f"{name}_mean": float(values.mean()),
        f"{name}_p50": p50,
        f"{name}_p95": p95,
        f"{name}_p99": p99,
    }
