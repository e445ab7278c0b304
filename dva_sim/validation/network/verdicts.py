"""Comparison rules: measures, bands, and conditions that must not be judged.

One number per run and measure is compared, from sockets and from the model alike. Which kind a
condition is, and whether it may be judged, is decided by the condition alone: without loss by
bands, single runs under loss by the model's own spread. The bands are asked for; nothing in them
was chosen after a look at what they judge.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dva_sim.network.pattern_runs import COMMAND_BYTES, REPLY_BYTES, Condition
from dva_sim.validation.network.reference import SocketRun

ConditionKind = Literal["lossless", "overload", "single", "pooled"]
KINDS: tuple[ConditionKind, ...] = ("lossless", "overload", "single", "pooled")

OVERLOAD = 0.95  # load above which queues grow
POOLED_SEEDS = 6
PACKET_BYTES = 61  # IPv4, TCP with time stamps, and ZMTP's frame header [B]


@dataclass(frozen=True)
class ConditionGroup:
    """All runs of one condition that are judged together.

    Attributes:
        kind: Kind of band for judging it.
        runs: The runs.
        left_out: Reason why it is not judged at all; empty if it is.
    """

    condition: Condition
    kind: ConditionKind
    runs: tuple[SocketRun, ...]
    left_out: str = ""


def grouped(runs: Sequence[SocketRun]) -> list[ConditionGroup]:
    """Group the runs by condition; under loss, prefer those with independent random losses."""
    by_condition: dict[Condition, list[SocketRun]] = {}
    for run in runs:
        by_condition.setdefault(run.condition, []).append(run)
    return [_group(condition, own) for condition, own in by_condition.items()]


def _group(condition: Condition, runs: Sequence[SocketRun]) -> ConditionGroup:
    independent = [run for run in runs if run.independent]
    if condition.loss == 0:
        kind: ConditionKind = "overload" if load(condition) >= OVERLOAD else "lossless"
        return ConditionGroup(condition, kind, tuple(runs), why_not_judged(condition))
    pooled = len({run.seed for run in independent}) >= POOLED_SEEDS
    kind = "pooled" if pooled else "single"
    reason = why_not_judged(condition)
    if not independent:
        reason = reason or "shares its random numbers with other conditions"
    return ConditionGroup(condition, kind, tuple(independent or runs), reason)


def why_not_judged(condition: Condition) -> str:
    """Return the reason why a condition must not be judged; empty if it may.

    Where the service time is a whole number of periods, the next command comes just when the
    robot is free: whether it counts hangs on how much longer than asked a program sleeps.
    """
    if condition.cc == "bbr":
        return "congestion control BBR is not modelled"
    periods = condition.hz * condition.proc_ms / 1000.0
    if math.isclose(periods, 1.0):
        return "the service time equals the period"
    latest = condition.conflate in ("rob", "both")
    if latest and periods > 1 and math.isclose(periods, round(periods)):
        return "microseconds decide which command is the latest"
    return ""


def load(condition: Condition) -> float:
    """Return the load of robot and link, as a share of their capacity.

    A requester waits for its reply, so it asks too much only of a robot that needs longer
    than the time-out: requests then come at that pace.
    """
    if condition.pattern == "req-rep":
        assert condition.timeout_ms is not None
        late = condition.proc_ms >= condition.timeout_ms
        return condition.proc_ms / condition.timeout_ms if late else 0.0
    robot = condition.hz * condition.proc_ms / 1000.0
    link = condition.hz * 8e-3 * (COMMAND_BYTES + PACKET_BYTES) / condition.rate_kbit
    return max(robot, link)


def is_bounded(condition: Condition) -> bool:
    """Return True if a buffer is smaller than by default."""
    small = condition.sndbuf is not None or condition.rcvbuf is not None
    return small or condition.hwm < 1000 or condition.conflate != "none"


def may_livelock(condition: Condition) -> bool:
    """Return True if one loss can end all control.

    A new socket needs three round trips before its request leaves, and the reply needs one more and
    the service time.
    """
    if condition.pattern != "req-rep" or condition.loss == 0:
        return False
    assert condition.timeout_ms is not None
    line = 8.0 * (COMMAND_BYTES + REPLY_BYTES + 2 * PACKET_BYTES) / condition.rate_kbit  # [ms]
    trip = 2 * condition.delay_ms * (1 + condition.jitter_frac) + line
    return condition.timeout_ms <= 4 * trip + condition.proc_ms


Floats = NDArray[np.float64]
Row = Mapping[str, float]


@dataclass(frozen=True)
class ComparedMeasure:
    """One thing that is compared.

    Attributes:
        name: Column of the measure.
        words: Description of the measure.
        unit: Unit of its values.
    """

    name: str
    words: str
    unit: str

    @property
    def is_time(self) -> bool:
        """True if bands in milliseconds apply to it."""
        return self.unit == "ms"

    @property
    def is_tail(self) -> bool:
        """True if it is a 95th percentile."""
        return self.name.endswith("_p95")


MEASURES = (
    ComparedMeasure("applied_hz", "commands applied per second", "1/s"),
    ComparedMeasure("age_p50", "age when applied, median", "ms"),
    ComparedMeasure("age_p95", "age when applied, 95th percentile", "ms"),
    ComparedMeasure("stale_p50", "age while in force, median", "ms"),
    ComparedMeasure("stale_p95", "age while in force, 95th percentile", "ms"),
    ComparedMeasure("rtt_p50", "round trip, median", "ms"),
    ComparedMeasure("rtt_p95", "round trip, 95th percentile", "ms"),
    ComparedMeasure("delivered", "delivered share", ""),
    ComparedMeasure("queue", "commands under way", ""),
    ComparedMeasure("timeouts", "time-outs", ""),
    ComparedMeasure("alerts", "alerts", ""),
)
BY_NAME = {measure.name: measure for measure in MEASURES}
JUDGED_EXACTLY = MEASURES[:7]
"""Results with a band in runs without loss; the rest are only shown there."""


def values_of(row: Row) -> dict[str, float]:
    """Return the measures of one run, from the columns of results.

    Those that have no column of their own:

    - `delivered`: different commands applied over commands sent, in the window;
    - `queue`: commands sent and not yet applied, on average, by Little's law from the rate of
      applications and their mean age.
    """
    sent = row["n_sent"]
    rate = row["applied_hz"]
    age = row["age_mean"]
    values = {m.name: row[m.name] for m in MEASURES if m.name in row}
    values["delivered"] = row["n_distinct"] / sent if sent else math.nan
    values["queue"] = rate * age / 1000.0 if rate else 0.0
    return values


@dataclass(frozen=True)
class ComparedCell:
    """One measure of one condition, measured and predicted.

    Attributes:
        group: Condition with its measured runs.
        measured: A value for each run on sockets, without those that are not defined.
        predicted: Predicted values, run by run.
    """

    group: ConditionGroup
    measure: ComparedMeasure
    measured: Floats
    predicted: Floats

    @property
    def real(self) -> float:
        """Mean of the measured values."""
        return float(self.measured.mean()) if len(self.measured) else math.nan

    @property
    def model(self) -> float:
        """Mean of the predicted values."""
        return float(self.predicted.mean()) if len(self.predicted) else math.nan

    @property
    def off(self) -> float:
        """Relative error of the prediction."""
        return self.model / self.real - 1 if self.real else math.nan


def compare_cells(group: ConditionGroup, predicted: Sequence[Row]) -> list[ComparedCell]:
    """Return every measure of a condition that is defined on either side.

    Time-outs and alerts are a requester's.
    """
    real = [values_of(run.values) for run in group.runs]
    model = [values_of(row) for row in predicted]
    measures = MEASURES if group.condition.pattern == "req-rep" else MEASURES[:-2]
    cells = [ComparedCell(group, m, _column(real, m), _column(model, m)) for m in measures]
    return [cell for cell in cells if len(cell.measured) or len(cell.predicted)]


def _column(rows: Sequence[Row], measure: ComparedMeasure) -> Floats:
    values = np.array([row.get(measure.name, math.nan) for row in rows], dtype=float)
    return np.asarray(values[~np.isnan(values)])


CellWord = Literal["inside", "outside", "shown only"]

SHARES: dict[ConditionKind, float] = {"lossless": 0.05, "overload": 0.10, "pooled": 0.05}
"""Half-widths of bands; of pooled conditions, where runs hardly differ."""
BOUNDED_SHARE = 0.15  # half-width of the band under overload with bounded buffers
TIME_MS = 2.0  # added to the share
RATE_HZ = 0.05  # added to the share
NOT_REALTIME_MS = 10.0  # added for 95th percentiles without real-time priority
LATE_MS = 5.0  # no 95th percentile is judged if the link's own 99th is later
INTERVAL = (2.5, 97.5)  # percentiles of the model's runs
WIDER = 0.02  # the interval is made wider by this share, and by TIME_MS
MIN_APPLIED = 20  # commands applied in a single run that is judged
MIN_INSIDE = 0.90  # share of the pairs of condition and measure


@dataclass(frozen=True)
class CellVerdict:
    """One measure of one condition, judged.

    Attributes:
        low: From here ...
        high: ... to here it passes; for a single run under loss, of what was measured, else of
            what was predicted.
        why: Reason why it is shown only; empty if it is judged.
    """

    cell: ComparedCell
    low: float
    high: float
    why: str = ""

    @property
    def compared(self) -> float:
        """Value that has to lie in the band."""
        return self.cell.real if self.cell.group.kind == "single" else self.cell.model

    @property
    def word(self) -> CellWord:
        """The verdict."""
        if self.why:
            return "shown only"
        return "inside" if self.low <= self.compared <= self.high else "outside"


def judge(cell: ComparedCell) -> CellVerdict:
    """Judge a condition without loss, one run under loss, or pooled ones that hardly differ."""
    why = reason_against(cell)
    low, high = _interval(cell) if cell.group.kind == "single" else _band(cell)
    return CellVerdict(cell, low, high, why)


def reason_against(cell: ComparedCell) -> str:
    """Return the reason why a measure of a condition is not judged; empty if it is."""
    group = cell.group
    measure = cell.measure
    if group.left_out:
        return group.left_out
    if not len(cell.measured):
        return "was not measured"
    if measure.is_tail and max(run.values["emu_late_p99_ms"] for run in group.runs) > LATE_MS:
        return "the emulated link was late"
    if group.kind in ("lossless", "overload"):
        return "" if measure in JUDGED_EXACTLY else "has no band without loss"
    if group.kind == "single":
        condition = cell.group.condition
        if cell.group.runs[0].values["n_applied"] < MIN_APPLIED:
            return f"fewer than {MIN_APPLIED} commands applied"
        if may_livelock(condition) and cell.measure.name.endswith("_p50"):
            return "a single median where one loss can end all control"
    return ""


def _band(cell: ComparedCell) -> tuple[float, float]:
    """Return the band around the measured value."""
    group = cell.group
    measure = cell.measure
    real = cell.real
    share = SHARES.get(group.kind, math.nan)
    if group.kind == "overload" and is_bounded(group.condition):
        share = BOUNDED_SHARE
    half = share * abs(real) + _absolute(cell)
    if measure.is_tail and not all(run.realtime for run in group.runs):
        half += NOT_REALTIME_MS
    return real - half, real + half


def _absolute(cell: ComparedCell) -> float:
    """Return the absolute part of the band, added to the share; none in an overload."""
    if cell.group.kind == "overload":
        return 0.0
    return TIME_MS if cell.measure.is_time else RATE_HZ


def _interval(cell: ComparedCell) -> tuple[float, float]:
    """Return the widened 95 % prediction interval of one run.

    Empty where nothing is predicted.
    """
    if not len(cell.predicted):
        return math.inf, -math.inf
    low, high = np.percentile(cell.predicted, INTERVAL, method="inverted_cdf")
    more = TIME_MS if cell.measure.is_time else 0.0
    return float(low - WIDER * abs(low) - more), float(high + WIDER * abs(high) + more)


def share_inside(verdicts: Sequence[CellVerdict]) -> tuple[int, int]:
    """Return the number of judged verdicts inside, and number of judged verdicts."""
    judged = [v for v in verdicts if v.word != "shown only"]
    return sum(v.word == "inside" for v in judged), len(judged)
