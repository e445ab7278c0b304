"""Measures of commands over real middleware: meaning of each column, and its computation.

**Applied** is a command that arrived before any newer one: a robot drops older ones. Its **age** is
from when it was made until then. The **age in force** at any moment is that of the newest applied
command; before the first one it is the time since the run began.

References:
    S. Kaul, R. Yates, M. Gruteser: Real-time status: how often should one update? INFOCOM 2012.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.measure import Measure

Row = dict[str, Any]
Floats = NDArray[np.float64]

RUN_COLUMNS = (
    Measure("connected", "whether both ends were connected in time: 1 or 0", low=0, high=1),
    Measure("connected_after_s", "from the start until both ends were connected"),
    Measure("commands", "commands handed to the transport while measuring"),
    Measure("not_taken", "commands that the transport did not take: busy, or a queue was full"),
    Measure(
        "command_rate_hz",
        "commands applied per second",
        title="applied command rate",
        better="large",
    ),
    Measure("outdated_share", "share of the commands that arrived after a newer one"),
    Measure("command_age_p50_s", "median age of applied commands at arrival"),
    Measure("command_age_p95_s", "percentile 95 of this age"),
    Measure(
        "age_in_force_mean_s",
        "age of the newest applied command, mean over time",
        title="mean age of the command in force",
    ),
    Measure(
        "age_in_force_p50_s",
        "age of the newest applied command, median over time",
        title="median age of the command in force",
    ),
    Measure("age_in_force_p95_s", "the same, percentile 95 over time"),
    Measure("too_old_share", "share of the time in which no command younger than the limit rules"),
    Measure("longest_gap_s", "longest time between two applied commands"),
    Measure("false_stops", "times that the watchdog stopped the robot while the operator sent"),
    Measure("picture_rate_hz", "pictures shown per second", better="large"),
    Measure("picture_age_p50_s", "median age of the pictures at arrival"),
    Measure("picture_age_p95_s", "percentile 95 of this age"),
    Measure("up_bytes", "bytes that crossed the link towards the robot, with all headers"),
    Measure("down_bytes", "bytes that crossed the link from the robot, with all headers"),
    Measure("late_p99_s", "percentile 99 of how late the link itself was"),
    Measure("late_max_s", "the most that the link itself was late"),
    Measure("attempts", "runs made until one was undisturbed"),
    Measure("disturbed", "whether the last of them was disturbed, too: 1 or 0", low=0, high=1),
    Measure("load", "runnable processes of the machine when the run began, one-minute mean"),
)
"""Columns of a run, which a study may ask for."""
COMMAND_COLUMNS = (
    Measure("number", "number of the command or picture"),
    Measure("made_s", "when it was made, in the time of the run"),
    Measure("arrived_s", "when it was applied, or shown; empty if never"),
)
PICTURE_COLUMNS = COMMAND_COLUMNS


class Window(NamedTuple):
    """The time that is measured, and when the run began, by one clock [s]."""

    start: float
    since: float
    until: float

    @property
    def length(self) -> float:
        """Length of the window [s]."""
        return self.until - self.since


class Ages:
    """The age in force over a window, piece by piece; in each it grows as time does.

    Args:
        made: Creation time of each applied command [s], shape `(n,)`, in the order of application.
        applied: Time of application [s], shape `(n,)`.
        window: The time looked at.
    """

    def __init__(self, made: Floats, applied: Floats, window: Window) -> None:
        made = np.concatenate([[window.start], made])
        edges = np.concatenate([[window.start], applied, [math.inf]])
        edges = np.clip(edges, window.since, window.until)
        is_seen = np.diff(edges) > 0
        self.youngest: Floats = (edges[:-1] - made)[is_seen]
        self.oldest: Floats = (edges[1:] - made)[is_seen]

    @property
    def mean(self) -> float:
        """Over time [s]."""
        lengths = self.oldest - self.youngest
        return float(np.average(0.5 * (self.youngest + self.oldest), weights=lengths))

    def share_above(self, age: float) -> float:
        """Share of the time in which it is above an age [s]."""
        above = np.clip(self.oldest - np.maximum(self.youngest, age), 0.0, None)
        return float(above.sum() / (self.oldest - self.youngest).sum())

    def quantile(self, share: float) -> float:
        """The age that is not exceeded in a share of the time [s]."""
        ages = np.unique(np.concatenate([self.youngest, self.oldest]))
        below = np.array([1.0 - self.share_above(age) for age in ages])
        return float(np.interp(share, below, ages))


def gaps(applied: Floats, window: Window) -> Floats:
    """Times without a newer command [s] that overlap the window, whole, its edges as bounds."""
    inside = applied[(applied > window.since) & (applied < window.until)]
    return np.diff(np.concatenate([[window.since], inside, [window.until]]))


def command_row(
    made: Floats, applied: Floats, window: Window, *, max_age_s: float, watchdog_s: float
) -> Row:
    """Return the measures of the applied commands.

    Args:
        made: Creation time of each command [s], shape `(n,)`, in the order of application.
        applied: Time of application [s], shape `(n,)`.
        window: The time looked at.
        max_age_s: The robot's limit.
        watchdog_s: The robot stops after so long without a newer command.
    """
    force = Ages(made, applied, window)
    pauses = gaps(applied, window)
    inside = (applied >= window.since) & (applied < window.until)
    ages = (applied - made)[inside]
    return {
        "command_rate_hz": float(inside.sum()) / window.length,
        "command_age_p50_s": _percentile(ages, 50),
        "command_age_p95_s": _percentile(ages, 95),
        "age_in_force_mean_s": force.mean,
        "age_in_force_p50_s": force.quantile(0.5),
        "age_in_force_p95_s": force.quantile(0.95),
        "too_old_share": force.share_above(max_age_s),
        "longest_gap_s": float(pauses.max()),
        "false_stops": int((pauses > watchdog_s).sum()),
    }


def picture_row(taken: Floats, shown: Floats, window: Window) -> Row:
    """Return the measures of the pictures that arrived.

    Args:
        taken: Capture time of each picture [s], shape `(n,)`.
        shown: Arrival time of each picture [s], shape `(n,)`.
        window: The time looked at.
    """
    inside = (shown >= window.since) & (shown < window.until)
    ages = (shown - taken)[inside]
    return {
        "picture_rate_hz": float(inside.sum()) / window.length,
        "picture_age_p50_s": _percentile(ages, 50),
        "picture_age_p95_s": _percentile(ages, 95),
    }


def _percentile(values: Floats, q: float) -> float:
    """nan of nothing."""
    return float(np.percentile(values, q)) if len(values) else math.nan
