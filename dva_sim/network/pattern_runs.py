"""A measured run of commands under a messaging pattern: what is set before it, what it came to.

The same condition is measured on real sockets and predicted by the model; both give a row
with the columns named here. An operator's program sends numbered commands of 400 bytes to a
robot's program, which works on one at a time and answers with 200. Both note when things
happened, on one clock; what that comes to is counted here, within a window that begins when the
warm-up is over.
"""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.network.age_in_force import AgeInForce, Floats
from dva_sim.network.link import LinkConfig
from dva_sim.network.link.losses import Bursts
from dva_sim.network.messaging import CommandSockets
from dva_sim.network.workload import (
    UNBOUNDED,
    MessageForm,
    Note,
    NoteKind,
    NoteTaker,
    OperatorWorkload,
    PublishEnd,
    RequestEnd,
)

UNLIMITED_BPS = 1e12
COMMAND_BYTES = 400
REPLY_BYTES = 200
STALE_STEP_S = 0.005  # the command in force is looked at this often

RESULTS = (
    *("n_sent", "n_applied", "n_distinct", "send_hz", "applied_hz", "dup", "skip_frac"),
    "first_seq",
    *(f"age_{share}" for share in ("mean", "p50", "p95", "p99")),
    *(f"rtt_{share}" for share in ("mean", "p50", "p95", "p99")),
    *(f"stale_{share}" for share in ("mean", "p50", "p95", "p99")),
    *("gap_p95", "gap_max", "timeouts", "alerts", "t_conn_ms", "t_hs_ms"),
)
"""Results of a run, the same for sockets and model; times in ms, None where not defined."""

EMULATOR_RESULTS = (
    *("emu_pkts_ab", "emu_lost_ab", "emu_tail_ab"),
    *("emu_pkts_ba", "emu_lost_ba", "emu_tail_ba"),
    *("emu_late_p50_ms", "emu_late_p99_ms", "emu_late_max_ms"),
)
"""Figures of the emulated link: a is the operator, b the robot."""

COLUMN_WORDS = {"req": "req-rep", "pub": "pub-sub", "dealer": "pipelined"}
"""Patterns as tables, plans and labels of measurements write them, and what they are called."""

_WRITTEN = {name: word for word, name in COLUMN_WORDS.items()}
_CHOICES = {
    "pattern": tuple(_WRITTEN),
    "conflate": ("none", "op", "rob", "both"),
    "cc": ("cubic", "reno", "bbr"),
}
_SHORT = {"queue_pkts": "q", "burst_pkts": "burst"}
_WORDS = {"": None, "auto": None, "inf": math.inf}


@dataclass(frozen=True)
class Condition:
    """One cell of the comparison; times in ms because the tables are.

    Attributes:
        pattern: `req-rep`, `pub-sub`, or `pipelined` without a window; the words of tables
            (`COLUMN_WORDS`) are understood, too.
        hz: Wanted command rate. `req-rep` sends the next command at the later of the end of the
            last one and its issue + 1/hz; the others keep a fixed grid.
        proc_ms: The robot's service time.
        timeout_ms: REQ: after it the socket is closed and the same command goes over a new one.
        attempts: REQ: so many times in all, then an alert and the next command.
        conflate: End that keeps only the last message.
        hwm: High-water marks of both ends.
        sndbuf: Send buffer of the operator [B]; None is the kernel's own choice.
        rcvbuf: Receive buffer of the robot [B]; None is the kernel's own choice.
        delay_ms: One-way delay.
        jitter_frac: Half-width of a uniform law, as a share of the delay.
        loss: Share of packets lost, each direction.
        rate_kbit: Rate of each direction [kbit/s]; infinite: unlimited.
        queue_pkts: Packets that find room before the link, drop-tail.
        reorder: Packets may overtake one another.
        cc: Congestion control.
        wait_hs: Commands start after the handshake instead of at once.
        warm_s: Time from the first command to the statistics.
        dur_s: Time that the statistics cover.
        burst_pkts: Mean length of a run of lost packets (Gilbert-Elliott, everything lost in
            the bad state); None is independent losses.
    """

    pattern: str
    hz: float
    proc_ms: float = 5.0
    timeout_ms: float | None = None
    attempts: int | None = None
    conflate: str = "none"
    hwm: int = 1000
    sndbuf: int | None = None
    rcvbuf: int | None = None
    delay_ms: float = 0.0
    jitter_frac: float = 0.0
    loss: float = 0.0
    rate_kbit: float = math.inf
    queue_pkts: int = 100
    reorder: bool = False
    cc: str = "cubic"
    wait_hs: bool = True
    warm_s: float = 1.0
    dur_s: float = 40.0
    burst_pkts: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "pattern", COLUMN_WORDS.get(self.pattern, self.pattern))
        for name, choices in _CHOICES.items():
            if getattr(self, name) not in choices:
                raise ConfigError(unknown(name, getattr(self, name), choices))
        is_given = [value is not None for value in (self.timeout_ms, self.attempts)]
        if is_given != [self.pattern == "req-rep"] * 2:
            raise ConfigError("timeout_ms and attempts belong to pattern req-rep, and only to it")
        if self.conflate != "none" and self.pattern != "pub-sub":
            raise ConfigError(
                f"conflate {self.conflate!r} belongs to pattern pub-sub, and only to it"
            )
        for name, problem in _out_of_range(self):
            raise ConfigError(f"{name} {getattr(self, name):g} {problem}")

    @property
    def subscription_wait_s(self) -> float:
        """Time that a publisher waits after its own handshake [s].

        The subscriber's handshake ends half a round trip later, and its subscription needs
        another half; with as much again as four small packets take on the link, and 5 ms.
        """
        if self.pattern != "pub-sub" or not self.wait_hs:
            return 0.0
        round_trip = 2e-3 * self.delay_ms * (1.0 + self.jitter_frac)
        return round_trip + 4 * 120 * 8 / (1e3 * self.rate_kbit) + 0.005

    @property
    def label(self) -> str:
        """A name that a person can read; it leaves out what is as usual."""
        rate = 0 if math.isinf(self.rate_kbit) else self.rate_kbit
        text = f"{_WRITTEN[self.pattern]}{self.hz:g}_d{self.delay_ms:g}_j{100 * self.jitter_frac:g}"
        text += f"_l{100 * self.loss:g}_r{rate:g}_p{self.proc_ms:g}"
        return text + "".join(f"_{part}" for part in _unusual(self))

    @property
    def hash(self) -> str:
        """Eight digits that differ when anything that is set differs."""
        text = ";".join(f"{name}={value}" for name, value in self.to_row().items())
        return hashlib.sha256(text.encode()).hexdigest()[:8]

    def link(self, late_s: float = 0.0) -> LinkConfig:
        """Return the link of the condition, alike in both directions, with some delay added [s]."""
        bursts = self.burst_pkts
        return LinkConfig(
            delay_s=self.delay_ms / 1000.0 + late_s,
            jitter_s=self.delay_ms * self.jitter_frac / 1000.0,
            loss=self.loss,
            bursts=None if bursts is None else Bursts(mean_packets=bursts),
            rate_bps=min(1000.0 * self.rate_kbit, UNLIMITED_BPS),
            queue_packets=self.queue_pkts,
            reorder=self.reorder,
        )

    def to_row(self) -> dict[str, str]:
        """Return the columns of the condition as a table holds them."""
        row = {name: _written(name, getattr(self, name)) for name in CONDITION}
        return row | {"pattern": _WRITTEN[self.pattern]}

    @classmethod
    def from_row(cls, row: Mapping[str, Any]) -> Condition:
        """Return the condition of a row read from a table; other columns do not matter.

        Raises:
            ConfigError: a value is not as it should be.
        """
        return cls(**{name: _read(name, str(row[name])) for name in CONDITION if name in row})


def make_operator(
    condition: Condition, transport: CommandSockets, form: MessageForm, note: NoteTaker
) -> OperatorWorkload:
    """Return the operator's program of a condition, over any transport.

    Args:
        transport: Carries the commands.
        form: Their bytes.
        note: Adds notes.
    """
    in_step = condition.pattern == "req-rep"
    end = (
        PublishEnd(transport, form)
        if condition.pattern == "pub-sub"
        else RequestEnd(
            transport,
            form,
            timeout=UNBOUNDED if condition.timeout_ms is None else condition.timeout_ms / 1000.0,
            attempts=condition.attempts or 1,
            window=1 if in_step else UNBOUNDED,
        )
    )
    return OperatorWorkload(transport.clock, end, note, condition.hz, in_step)


CONDITION = tuple(field.name for field in dataclasses.fields(Condition))
"""The columns of a condition, in their order."""

_KINDS = get_type_hints(Condition)


def _out_of_range(condition: Condition) -> list[tuple[str, str]]:
    """List values that no link or program can have."""
    wrong = []
    positive = ("hz", "hwm", "rate_kbit", "queue_pkts", "dur_s", "timeout_ms", "attempts")
    for name in (*positive, "sndbuf", "rcvbuf"):
        value = getattr(condition, name)
        if value is not None and not value > 0:
            wrong.append((name, "should be above 0"))
    for name in ("proc_ms", "delay_ms", "warm_s"):
        if not 0 <= getattr(condition, name) < math.inf:
            wrong.append((name, "should be a finite number from 0 on"))
    if not 0 <= condition.loss <= 0.9:
        wrong.append(("loss", "should lie between 0 and 0.9"))
    if not 0 <= condition.jitter_frac <= 1:
        wrong.append(("jitter_frac", "should lie between 0 and 1"))
    if condition.burst_pkts is not None and not condition.burst_pkts >= 1:
        wrong.append(("burst_pkts", "should be at least 1"))
    return wrong


def _unusual(condition: Condition) -> list[str]:
    parts = []
    if condition.timeout_ms is not None:
        parts.append(f"T{condition.timeout_ms:g}")
    if condition.attempts not in (None, 3):
        parts.append(f"x{condition.attempts}")
    if condition.conflate != "none":
        parts.append(f"conflate{condition.conflate}")
    usual = {"hwm": 1000, "sndbuf": None, "rcvbuf": None, "queue_pkts": 100, "burst_pkts": None}
    for name, value in usual.items():
        if getattr(condition, name) != value:
            parts.append(f"{_SHORT.get(name, name)}{getattr(condition, name):g}")
    if condition.reorder:
        parts.append("reorder")
    if condition.cc != "cubic":
        parts.append(condition.cc)
    if not condition.wait_hs:
        parts.append("nowait")
    return parts


def _written(name: str, value: Any) -> str:
    if value is None:
        return "auto" if name in ("sndbuf", "rcvbuf") else ""
    if isinstance(value, bool):
        return str(int(value))
    return value if isinstance(value, str) else f"{value:.12g}"


def _read(name: str, text: str) -> Any:
    kind = _KINDS[name]
    if kind is str:
        return text
    try:
        number = _WORDS[text] if text in _WORDS else float(text)
        if kind is bool:
            return {0.0: False, 1.0: True}[number]  # type: ignore[index]
        if number is None or kind in (float, float | None):
            return number
        if number != int(number):
            raise ValueError
        return int(number)
    except (ValueError, KeyError, OverflowError):
        raise ConfigError(f"{name} {text!r} is not a number that {name} can have") from None


Measures = dict[str, float]
"""Name to value; nan where it is not defined."""

MS = 1000.0
PERCENTILES = (50, 95, 99)


@dataclass
class RunLog:
    """Log of one run; times [s] on one clock.

    Attributes:
        start: Time at which the first command was due.
        issued: Time at which each command was first sent.
        applied: Index of each command whose processing ended, and when; repetitions count.
        replied: Index of each command whose reply arrived, and when.
        timeouts: Times at which the operator gave up waiting for a reply.
        alerts: Times at which the operator gave up a command after the last attempt.
        connected_s: Time from opening the first socket to TCP's connection [s].
        handshake_s: Time from opening the first socket to the end of ZeroMQ's handshake [s].
    """

    start: float = 0.0
    issued: list[float] = field(default_factory=list)
    applied: list[tuple[int, float]] = field(default_factory=list)
    replied: list[tuple[int, float]] = field(default_factory=list)
    timeouts: list[float] = field(default_factory=list)
    alerts: list[float] = field(default_factory=list)
    connected_s: float = math.nan
    handshake_s: float = math.nan

    @classmethod
    def of(cls, notes: Iterable[Note]) -> RunLog:
        """Return the log that both programs' notes come to."""
        times: dict[NoteKind, list[tuple[int, float]]] = {kind: [] for kind in NoteKind}
        for kind, number, at in notes:
            times[kind].append((number - 1, at))
        opened, connected, ready, started = (
            times[kind][0][1] if times[kind] else math.nan
            for kind in (NoteKind.OPENED, NoteKind.CONNECTED, NoteKind.READY, NoteKind.STARTED)
        )
        return cls(
            start=started,
            issued=list(dict(times[NoteKind.SENT]).values()),
            applied=times[NoteKind.APPLIED],
            replied=times[NoteKind.REPLIED],
            timeouts=[at for _, at in times[NoteKind.TIMEOUT]],
            alerts=[at for _, at in times[NoteKind.ALERT]],
            connected_s=connected - opened,
            handshake_s=ready - opened,
        )

    def arrivals(self) -> tuple[Floats, Floats]:
        """Return the times of sending and application of the applied commands [s], `(n,)` each."""
        return (
            np.array([self.issued[index] for index, _ in self.applied]),
            np.array([at for _, at in self.applied]),
        )


def measure_log(log: RunLog, warm_s: float, dur_s: float) -> Measures:
    """Return every measure of a run, times in [ms], rates in [1/s].

    - `n_sent`, `send_hz`: commands sent for the first time within the window;
    - `n_applied`: applications within the window, repetitions included;
    - `n_distinct`, `applied_hz`: different commands among them; `dup`: the rest;
    - `skip_frac`: share of the commands sent within the window that were never applied
      although a later one was;
    - `first_seq`: lowest number of a command that was ever applied;
    - `age_*`: application minus first sending, of the applications within the window;
    - `rtt_*`: reply minus first sending, of the commands sent within the window;
    - `stale_*`: age of the command in force (`AgeInForce`), looked at every 5 ms;
    - `gap_*`: between applications; the window's ends count as such;
    - `timeouts`, `alerts`: within the window; what a publisher does not have counts as 0;
    - `t_conn_ms`, `t_hs_ms`: connecting, and the whole handshake.

    Args:
        warm_s: Start of the window, after the start of the run [s].
        dur_s: Length of the window [s].
    """
    issued = np.array(log.issued) - log.start
    numbers = np.array([number for number, _ in log.applied], dtype=int)
    applied = np.array([when for _, when in log.applied]) - log.start
    end = warm_s + dur_s
    sent = _within(issued, warm_s, end)
    inside = _within(applied, warm_s, end)
    distinct = len(set(numbers[inside].tolist()))
    measures: Measures = {"n_sent": int(sent.sum()), "n_applied": int(inside.sum())}
    measures |= {"n_distinct": distinct, "dup": measures["n_applied"] - distinct}
    measures |= {"send_hz": measures["n_sent"] / dur_s, "applied_hz": distinct / dur_s}
    measures["skip_frac"] = _skipped(np.flatnonzero(sent), numbers[inside])
    measures["first_seq"] = float(numbers.min()) if len(numbers) else math.nan
    measures |= summary("age", applied[inside] - issued[numbers[inside]])
    trips = [
        when - log.start - issued[number]
        for number, when in log.replied
        if sent[number] and when - log.start < end
    ]
    measures |= summary("rtt", np.array(trips))
    looks = np.asarray(warm_s + STALE_STEP_S * np.arange(round(dur_s / STALE_STEP_S)))
    measures |= summary("stale", AgeInForce(issued[numbers], applied, 0.0).at(looks))
    gaps = np.diff(np.concatenate([[warm_s], applied[inside], [end]])) * MS
    measures |= {"gap_p95": float(np.percentile(gaps, 95)), "gap_max": float(gaps.max())}
    for name, times in (("timeouts", log.timeouts), ("alerts", log.alerts)):
        measures[name] = int(_within(np.array(times) - log.start, warm_s, end).sum())
    return measures | {"t_conn_ms": log.connected_s * MS, "t_hs_ms": log.handshake_s * MS}


def summary(name: str, values: Floats) -> Measures:
    """Mean and percentiles of times [s] in [ms], as `NAME_mean`, `NAME_p50`, ...; nan of none."""
    names = [f"{name}_mean", *(f"{name}_p{p}" for p in PERCENTILES)]
    if not len(values):
        return dict.fromkeys(names, math.nan)
    statistics = [values.mean(), *np.percentile(values, PERCENTILES)]
    return {key: MS * float(value) for key, value in zip(names, statistics, strict=True)}


def _within(times: Floats, start: float, end: float) -> NDArray[np.bool_]:
    return np.asarray((times >= start) & (times < end))


def _skipped(sent: NDArray[np.intp], applied: NDArray[np.intp]) -> float:
    """Return the share of the commands, up to the last applied one, that were never applied."""
    if not len(applied):
        return math.nan
    due = sent[sent <= applied.max()]
    return float(1 - np.isin(due, applied).mean()) if len(due) else math.nan
