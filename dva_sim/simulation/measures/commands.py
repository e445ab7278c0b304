"""Measures over a table of commands or pictures, whatever carried them: one definition each.

Which commands are applied, and how old the one in force is, `network.age_in_force` defines. The age
of an applied command is from when it was made until it arrived; the same holds of pictures that are
shown. Columns that several models have are described here once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.measure import Measure
from dva_sim.network.age_in_force import is_applied

Row = dict[str, Any]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
NAN = math.nan

COMMAND_RATE = Measure(
    "command_rate_hz",
    "commands applied per second; of a drive, per second of driving",
    title="applied command rate",
    better="large",
)
COMMAND_AGE_MEAN = Measure(
    "command_age_mean_s",
    "mean age of applied commands, from making to effect",
    title="mean command age at application",
)
COMMAND_AGE_P50 = Measure(
    "command_age_p50_s",
    "median age of applied commands, from making to effect",
    title="median command age at application",
)
COMMAND_AGE_P95 = Measure("command_age_p95_s", "percentile 95 of this age")
AGE_IN_FORCE = Measure(
    "age_in_force_mean_s",
    "age of the command in force, mean over time",
    title="mean age of the command in force",
)
PICTURE_RATE = Measure("picture_rate_hz", "pictures shown per second", better="large")
PICTURE_AGE_P95 = Measure("picture_age_p95_s", "percentile 95 of the age of pictures at arrival")
ROUND_TRIP_P50 = Measure(
    "round_trip_p50_s",
    "median time from a command's request to its answer",
    title="median time from request to answer",
)
ROUND_TRIP_P95 = Measure(
    "round_trip_p95_s",
    "percentile 95 of the time from a command's request to its answer",
    title="95th percentile of the time from request to answer",
)


def mean(values: Sequence[float] | NDArray[Any]) -> float:
    """Return nan of nothing."""
    return float(np.mean(values)) if len(values) else NAN


def percentile(values: Sequence[float] | Floats, q: float) -> float:
    """Return nan of nothing."""
    return float(np.percentile(values, q)) if len(values) else NAN


def percentiles(name: str, values: Sequence[float] | Floats, which: Iterable[int]) -> Row:
    """Return percentiles of durations [s] as `NAME_p50_s` and so on."""
    return {f"{name}_p{q:02}_s": percentile(values, q) for q in which}


def ratio(amount: float, of: float) -> float:
    """Return a share; nan if the whole is 0."""
    return amount / of if of else NAN


def restricted_mean(values: Iterable[float], horizon: float) -> float:
    """Return the mean of durations [s], with the horizon in place of NaN; NaN without any."""
    return mean([horizon if math.isnan(value) else value for value in values])


def applied(arrived: Floats) -> Bools:
    """Return which messages, in order of making, arrived before all newer ones, shape `(n,)`.

    Args:
        arrived: Arrival times [s], shape `(n,)`; infinity if never.
    """
    order = np.argsort(arrived, kind="stable")
    flags = np.empty(len(arrived), dtype=bool)
    flags[order] = is_applied(order)
    return flags & np.isfinite(arrived)


def round_trips(made: Floats, arrived: Floats, taken: Floats, shown_at: Floats) -> Floats:
    """Return times from an applied command to the first picture that can show it [s].

    Args:
        made: Creation times of the commands [s], shape `(n,)`.
        arrived: At the robot [s], shape `(n,)`.
        taken: Capture times of the pictures [s], shape `(m,)`.
        shown_at: At the operator [s], shape `(m,)`.
    """
    used = applied(arrived)
    soonest = np.append(np.minimum.accumulate(shown_at[::-1])[::-1], math.inf)
    trips = soonest[np.searchsorted(taken, arrived[used])] - made[used]
    return trips[np.isfinite(trips)]
