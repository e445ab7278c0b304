"""How a condition is judged, and what of it must not be: decided by the condition alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from dva_sim.experiments.validation.network.measured import Run
from dva_sim.network.condition import COMMAND_BYTES, REPLY_BYTES, Condition

Kind = Literal["lossless", "overload", "single", "pooled"]
KINDS: tuple[Kind, ...] = ("lossless", "overload", "single", "pooled")

OVERLOAD = 0.95  # from this load on, queues grow
POOLED_SEEDS = 6
PACKET_BYTES = 61  # IPv4, TCP with time stamps, and ZMTP's frame header [B]


@dataclass(frozen=True)
class Group:
    """All runs of one condition that are looked at together.

    Attributes:
        condition: What was set.
        kind: By which band it is judged.
        runs: The runs.
        left_out: Why it is not judged at all; empty if it is.
    """

    condition: Condition
    kind: Kind
    runs: tuple[Run, ...]
    left_out: str = ""


def grouped(runs: Sequence[Run]) -> list[Group]:
    """The runs by condition; under loss, those only whose luck is their own, if there are any."""
    by_condition: dict[Condition, list[Run]] = {}
    for run in runs:
        by_condition.setdefault(run.condition, []).append(run)
    return [_group(condition, own) for condition, own in by_condition.items()]


def _group(condition: Condition, runs: Sequence[Run]) -> Group:
    independent = [run for run in runs if run.independent]
    if condition.loss == 0:
        kind: Kind = "overload" if load(condition) >= OVERLOAD else "lossless"
        return Group(condition, kind, tuple(runs), reason_against(condition))
    pooled = len({run.seed for run in independent}) >= POOLED_SEEDS
    kind = "pooled" if pooled else "single"
    reason = reason_against(condition)
    if not independent:
        reason = reason or "shares its luck with other conditions"
    return Group(condition, kind, tuple(independent or runs), reason)


def reason_against(condition: Condition) -> str:
    """Why a condition must not be judged; empty if it may.

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
    """Share of what the robot and the link can do that is asked of them.

    A requester waits for its reply, so it asks too much only of a robot that needs longer
    than the time-out: requests then come at that pace.
    """
    if condition.pattern == "req":
        assert condition.timeout_ms is not None
        late = condition.proc_ms >= condition.timeout_ms
        return condition.proc_ms / condition.timeout_ms if late else 0.0
    robot = condition.hz * condition.proc_ms / 1000.0
    link = condition.hz * 8e-3 * (COMMAND_BYTES + PACKET_BYTES) / condition.rate_kbit
    return max(robot, link)


def is_bounded(condition: Condition) -> bool:
    """Whether a buffer somewhere is smaller than it is by default."""
    small = condition.sndbuf is not None or condition.rcvbuf is not None
    return small or condition.hwm < 1000 or condition.conflate != "none"


def may_livelock(condition: Condition) -> bool:
    """Whether one loss can end all control: a new socket needs three round trips before its
    request leaves, and the reply one more and the service time."""
    if condition.pattern != "req" or condition.loss == 0:
        return False
    assert condition.timeout_ms is not None
    line = 8.0 * (COMMAND_BYTES + REPLY_BYTES + 2 * PACKET_BYTES) / condition.rate_kbit  # [ms]
    trip = 2 * condition.delay_ms * (1 + condition.jitter_frac) + line
    return condition.timeout_ms <= 4 * trip + condition.proc_ms
