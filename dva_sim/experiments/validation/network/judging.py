"""Verdicts: without loss by bands, single runs under loss by the model's own spread.

The bands are asked for; nothing in them was chosen after a look at what they judge.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dva_sim.experiments.validation.network.kinds import Kind, is_bounded, may_livelock
from dva_sim.experiments.validation.network.samples import JUDGED_EXACTLY, Cell

Word = Literal["inside", "outside", "shown only"]

SHARES: dict[Kind, float] = {"lossless": 0.05, "overload": 0.10, "pooled": 0.05}
"""Half-widths of bands; of pooled conditions, where runs hardly differ."""
BOUNDED_SHARE = 0.15  # of an overload with bounded buffers
TIME_MS, RATE_HZ = 2.0, 0.05  # added to the share
NOT_REALTIME_MS = 10.0  # added for 95th percentiles without real-time priority
LATE_MS = 5.0  # no 95th percentile is judged if the link's own 99th is later
INTERVAL = (2.5, 97.5)  # percentiles of the model's runs
WIDER = 0.02  # the interval is made wider by this share, and by TIME_MS
MIN_APPLIED = 20  # commands applied in a single run that is judged
MIN_INSIDE = 0.90  # share of the pairs of condition and measure


@dataclass(frozen=True)
class Verdict:
    """One measure of one condition, judged.

    Attributes:
        cell: What is compared.
        low: From here ...
        high: ... to here it passes; for a single run under loss, of what was measured, else of
            what was predicted.
        why: Why it is shown only; empty if it is judged.
    """

    cell: Cell
    low: float
    high: float
    why: str = ""

    @property
    def compared(self) -> float:
        """What has to lie in the band."""
        return self.cell.real if self.cell.group.kind == "single" else self.cell.model

    @property
    def word(self) -> Word:
        """The verdict."""
        if self.why:
            return "shown only"
        return "inside" if self.low <= self.compared <= self.high else "outside"


def judge(cell: Cell) -> Verdict:
    """A condition without loss, a single run under loss, or pooled ones that hardly differ."""
    why = reason_against(cell)
    low, high = _interval(cell) if cell.group.kind == "single" else _band(cell)
    return Verdict(cell, low, high, why)


def reason_against(cell: Cell) -> str:
    """Why a measure of a condition is not judged; empty if it is."""
    group, measure = cell.group, cell.measure
    if group.left_out:
        return group.left_out
    if not len(cell.measured):
        return "was not measured"
    if measure.is_tail and max(run.values["emu_late_p99_ms"] for run in group.runs) > LATE_MS:
        return "the emulated link was late"
    if group.kind in ("lossless", "overload"):
        return "" if measure in JUDGED_EXACTLY else "has no band without loss"
    if group.kind == "single":
        return _against_single(cell)
    return ""


def _against_single(cell: Cell) -> str:
    condition = cell.group.condition
    if cell.group.runs[0].values["n_applied"] < MIN_APPLIED:
        return f"fewer than {MIN_APPLIED} commands applied"
    if may_livelock(condition) and cell.measure.name.endswith("_p50"):
        return "a single median where one loss can end all control"
    return ""


def _band(cell: Cell) -> tuple[float, float]:
    """Around what was measured."""
    group, measure, real = cell.group, cell.measure, cell.real
    share = SHARES.get(group.kind, math.nan)
    if group.kind == "overload" and is_bounded(group.condition):
        share = BOUNDED_SHARE
    half = share * abs(real) + _absolute(cell)
    if measure.is_tail and not all(run.realtime for run in group.runs):
        half += NOT_REALTIME_MS
    return real - half, real + half


def _absolute(cell: Cell) -> float:
    """What is added to the share; in an overload nothing."""
    if cell.group.kind == "overload":
        return 0.0
    return TIME_MS if cell.measure.is_time else RATE_HZ


def _interval(cell: Cell) -> tuple[float, float]:
    """The 95 % prediction interval of one run, made wider; empty where nothing is predicted."""
    if not len(cell.predicted):
        return math.inf, -math.inf
    low, high = np.percentile(cell.predicted, INTERVAL, method="inverted_cdf")
    more = TIME_MS if cell.measure.is_time else 0.0
    return float(low - WIDER * abs(low) - more), float(high + WIDER * abs(high) + more)


def share_inside(verdicts: Sequence[Verdict]) -> tuple[int, int]:
    """How many of those that are judged lie inside, and how many are judged."""
    judged = [v for v in verdicts if v.word != "shown only"]
    return sum(v.word == "inside" for v in judged), len(judged)
