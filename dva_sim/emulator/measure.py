"""A condition measured: real pyzmq programs over the emulated link, and what they came to."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

from dva_sim.emulator.cell import PACKETS, Job, Outcome
from dva_sim.emulator.notes import Kind, Note
from dva_sim.emulator.programs import HANDSHAKE_LIMIT_S
from dva_sim.emulator.running import refuse_for_proxy, run_job
from dva_sim.emulator.wire import WireConfig
from dva_sim.network.condition import EMULATOR_RESULTS, RESULTS, Condition
from dva_sim.network.measures import RunLog, measure_log
from dva_sim.streams import derive_seed

Row = dict[str, str]
_NOTES_PER_TURN = 8  # a command or an attempt
_DECIMALS = 4
COLUMNS = (*Condition("pub", 1).to_row(), *RESULTS, *EMULATOR_RESULTS, "realtime")
"""What a measurement tells: the condition, the results, the emulator, real-time priority."""


def measure(condition: Condition, seed: int, link: str = PACKETS) -> Row:
    """Run a condition once on real sockets.

    Args:
        condition: What is set.
        seed: Of the link's luck, together with the condition: no two share theirs.
        link: `packets`, or `proxy` where namespaces are forbidden.

    Returns:
        The columns `COLUMNS` as a table holds them; empty where a result is not defined.

    Raises:
        EmulatorError: the run failed, or this link cannot do what the condition asks.
    """
    job = job_of(condition, seed, link)
    refuse_for_proxy(job)
    outcome = run_job(job)
    results = measure_log(log_of(outcome), condition.warm_s, condition.dur_s) | outcome.link
    if condition.pattern != "req":
        results |= {"timeouts": math.nan, "alerts": math.nan}
    row = condition.to_row() | _written(results) | {"realtime": str(int(outcome.realtime))}
    return {name: row[name] for name in COLUMNS}


def job_of(condition: Condition, seed: int, link: str = PACKETS) -> Job:
    """What the process of such a run is told."""
    played_s = condition.warm_s + condition.dur_s
    patience_ms = condition.timeout_ms or math.inf
    return Job(
        "commands",
        WireConfig.of(condition),
        derive_seed(condition.hash, seed),
        bound_s=HANDSHAKE_LIMIT_S + condition.subscription_wait_s + played_s + 10.0,
        arguments=dataclasses.asdict(condition),
        congestion=condition.cc,
        link=link,
        room=1000 + int(_NOTES_PER_TURN * played_s * max(condition.hz, 1e3 / patience_ms)),
    )


def log_of(outcome: Outcome) -> RunLog:
    """What both programs noted, as the record that results are counted from."""
    log = RunLog(start=_time(outcome.operator, Kind.STARTED))
    opened = _time(outcome.operator, Kind.OPENED)
    log.connected_s = _time(outcome.operator, Kind.CONNECTED) - opened
    log.handshake_s = _time(outcome.operator, Kind.HANDSHAKE) - opened
    for kind, number, at in [*outcome.operator, *outcome.robot]:
        match kind:
            case Kind.ISSUED:
                log.issued.append(at)
            case Kind.REPLIED:
                log.replied.append((number, at))
            case Kind.TIMEOUT:
                log.timeouts.append(at)
            case Kind.ALERT:
                log.alerts.append(at)
            case Kind.APPLIED:
                log.applied.append((number, at))
    return log


def _time(notes: list[Note], kind: Kind) -> float:
    """When something happened first [s]; nan if it never did."""
    return next((at for noted, _, at in notes if noted == kind), math.nan)


def _written(results: Mapping[str, float]) -> Row:
    return {
        name: "" if math.isnan(value) else f"{round(value, _DECIMALS):.10g}"
        for name, value in results.items()
    }
