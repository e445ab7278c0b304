"""What a run of commands came to: one definition each, for simulated and for real sockets.

An operator's program sends numbered commands to a robot's program, which works on one at a
time. Both note when things happened, on one clock; what that comes to is counted here, within
a window that begins when the warm-up is over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dva_sim.network.condition import STALE_STEP_S

Floats = NDArray[np.float64]
Measures = dict[str, float]
"""Name to value; nan where it is not defined."""

MS = 1000.0
PERCENTILES = (50, 95, 99)
_TIE_S = 1e-6


@dataclass
class RunLog:
    """What happened in one run; times [s] on one clock.

    Attributes:
        start: When the first command was due.
        issued: When each command was sent first; its place is its number.
        applied: Number of each command whose processing ended, and when; repetitions count.
        replied: Number of each command whose reply arrived, and when.
        timeouts: When the operator gave up waiting for a reply.
        alerts: When it gave up a command after the last attempt.
        connected_s: From opening the first socket to TCP's connection [s].
        handshake_s: The same to the end of ZeroMQ's handshake.
    """

    start: float = 0.0
    issued: list[float] = field(default_factory=list)
    applied: list[tuple[int, float]] = field(default_factory=list)
    replied: list[tuple[int, float]] = field(default_factory=list)
    timeouts: list[float] = field(default_factory=list)
    alerts: list[float] = field(default_factory=list)
    connected_s: float = math.nan
    handshake_s: float = math.nan


def measure_log(log: RunLog, warm_s: float, dur_s: float) -> Measures:
    """Every measure of a run, times in [ms], rates in [1/s].

    - `n_sent`, `send_hz`: commands sent for the first time within the window;
    - `n_applied`: applications within the window, repetitions included;
    - `n_distinct`, `applied_hz`: different commands among them; `dup`: the rest;
    - `skip_frac`: share of the commands sent within the window that were never applied
      although a later one was;
    - `first_seq`: lowest number of a command that was ever applied;
    - `age_*`: application minus first sending, of the applications within the window;
    - `rtt_*`: reply minus first sending, of the commands sent within the window;
    - `stale_*`: age of the command applied last, looked at every 5 ms; time since the start
      before there is one;
    - `gap_*`: between applications; the window's ends count as such;
    - `timeouts`, `alerts`: within the window; what a publisher does not have counts as 0;
    - `t_conn_ms`, `t_hs_ms`: connecting, and the whole handshake.

    Args:
        log: What happened.
        warm_s: When the window begins, after the start [s].
        dur_s: How long it is [s].
    """
    issued = np.array(log.issued) - log.start
    numbers = np.array([number for number, _ in log.applied], dtype=int)
    applied = np.array([when for _, when in log.applied]) - log.start
    end = warm_s + dur_s
    sent, inside = _within(issued, warm_s, end), _within(applied, warm_s, end)
    distinct = len(set(numbers[inside].tolist()))
    found: Measures = {"n_sent": int(sent.sum()), "n_applied": int(inside.sum())}
    found |= {"n_distinct": distinct, "dup": found["n_applied"] - distinct}
    found |= {"send_hz": found["n_sent"] / dur_s, "applied_hz": distinct / dur_s}
    found["skip_frac"] = _skipped(np.flatnonzero(sent), numbers[inside])
    found["first_seq"] = float(numbers.min()) if len(numbers) else math.nan
    found |= summary("age", applied[inside] - issued[numbers[inside]])
    found |= summary("rtt", _round_trips(log, issued, sent, end))
    found |= summary("stale", _stale(issued, numbers, applied, warm_s, dur_s))
    gaps = np.diff(np.concatenate([[warm_s], applied[inside], [end]])) * MS
    found |= {"gap_p95": float(np.percentile(gaps, 95)), "gap_max": float(gaps.max())}
    for name, times in (("timeouts", log.timeouts), ("alerts", log.alerts)):
        found[name] = int(_within(np.array(times) - log.start, warm_s, end).sum())
    return found | {"t_conn_ms": log.connected_s * MS, "t_hs_ms": log.handshake_s * MS}


def summary(name: str, values: Floats) -> Measures:
    """Mean and percentiles of times [s] in [ms], as `NAME_mean`, `NAME_p50`, ...; nan of none."""
    names = [f"{name}_mean", *(f"{name}_p{p}" for p in PERCENTILES)]
    if not len(values):
        return dict.fromkeys(names, math.nan)
    found = [values.mean(), *np.percentile(values, PERCENTILES)]
    return {key: MS * float(value) for key, value in zip(names, found, strict=True)}


def _within(times: Floats, start: float, end: float) -> NDArray[np.bool_]:
    return np.asarray((times >= start) & (times < end))


def _skipped(sent: NDArray[np.intp], applied: NDArray[np.intp]) -> float:
    """Of the commands up to the last one applied, the share that was never applied."""
    if not len(applied):
        return math.nan
    due = sent[sent <= applied.max()]
    return float(1 - np.isin(due, applied).mean()) if len(due) else math.nan


def _round_trips(log: RunLog, issued: Floats, sent: NDArray[np.bool_], end: float) -> Floats:
    trips = [
        when - log.start - issued[number]
        for number, when in log.replied
        if sent[number] and when - log.start < end
    ]
    return np.array(trips)


def _stale(
    issued: Floats,
    numbers: NDArray[np.intp],
    applied: Floats,
    warm_s: float,
    dur_s: float,
) -> Floats:
    """Age of what is in force at each look; from the start on before anything is.

    What is applied at the very moment of a look is not seen by it: real programs are never
    early, and where commands keep step with the looks a tie would be worth a whole step.
    """
    looks = warm_s + STALE_STEP_S * np.arange(round(dur_s / STALE_STEP_S))
    origins = np.concatenate([[0.0], issued[numbers]])
    return np.asarray(looks - origins[np.searchsorted(applied + _TIE_S, looks)])
