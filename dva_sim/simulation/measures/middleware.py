"""Measures of commands over real middleware: meaning of each column, and its computation."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import compress

import numpy as np

from dva_sim.kernel.measure import Measure
from dva_sim.network.age_in_force import AgeInForce, is_applied
from dva_sim.network.workload import Note, NoteKind
from dva_sim.simulation.measures.commands import (
    AGE_IN_FORCE,
    COMMAND_AGE_P50,
    COMMAND_AGE_P95,
    COMMAND_RATE,
    PICTURE_AGE_P95,
    PICTURE_RATE,
    Floats,
    Row,
    percentiles,
)
from dva_sim.simulation.middleware.run import MiddlewareRun, Window

RUN_COLUMNS = (
    Measure("connected", "whether both ends were connected in time: 1 or 0", low=0, high=1),
    Measure("connected_after_s", "from the start until both ends were connected"),
    Measure("commands", "commands handed to the transport while measuring"),
    Measure("not_taken", "commands that the transport did not take: busy, or a queue was full"),
    COMMAND_RATE,
    Measure("outdated_share", "share of the commands that arrived after a newer one"),
    COMMAND_AGE_P50,
    COMMAND_AGE_P95,
    AGE_IN_FORCE,
    Measure(
        "age_in_force_p50_s",
        "age of the command in force, median over time",
        title="median age of the command in force",
    ),
    Measure("age_in_force_p95_s", "the same, percentile 95 over time"),
    Measure("too_old_share", "share of the time in which no command younger than the limit rules"),
    Measure("longest_gap_s", "longest time between two applied commands"),
    Measure("false_stops", "times that the watchdog stopped the robot while the operator sent"),
    PICTURE_RATE,
    Measure("picture_age_p50_s", "median age of the pictures at arrival"),
    PICTURE_AGE_P95,
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


def gaps(applied: Floats, window: Window) -> Floats:
    """Times without a newer command [s] that overlap the window, whole, its edges as bounds."""
    inside = applied[(applied > window.since) & (applied < window.until)]
    return np.diff(np.concatenate([[window.since], inside, [window.until]]))


def command_row(
    made: Floats, arrived: Floats, window: Window, *, max_age_s: float, watchdog_s: float
) -> Row:
    """Return the measures of the commands that arrived.

    Args:
        made: Creation time of each command [s], in the order of arrival; shape `(n,)`.
        arrived: Time of arrival [s], shape `(n,)`.
        window: The time looked at.
        max_age_s: The robot's limit.
        watchdog_s: The robot stops after so long without a newer command.
    """
    force = AgeInForce(made, arrived, window.start).over(window.since, window.until)
    used = is_applied(made)
    applied = arrived[used]
    pauses = gaps(applied, window)
    inside = (applied >= window.since) & (applied < window.until)
    ages = (applied - made[used])[inside]
    return {
        "outdated_share": 1.0 - float(used.mean()) if len(used) else math.nan,
        "command_rate_hz": float(inside.sum()) / window.length,
        **percentiles("command_age", ages, (50, 95)),
        "age_in_force_mean_s": force.mean,
        "age_in_force_p50_s": force.quantile(0.5),
        "age_in_force_p95_s": force.quantile(0.95),
        "too_old_share": force.share_above(max_age_s),
        "longest_gap_s": float(pauses.max()),
        "false_stops": int((pauses > watchdog_s).sum()),
    }


def picture_row(taken: Floats, shown_at: Floats, window: Window) -> Row:
    """Return the measures of the pictures that arrived.

    Args:
        taken: Capture time of each picture [s], shape `(n,)`.
        shown_at: Arrival time of each picture [s], shape `(n,)`.
        window: The time looked at.
    """
    inside = (shown_at >= window.since) & (shown_at < window.until)
    ages = (shown_at - taken)[inside]
    return {
        "picture_rate_hz": float(inside.sum()) / window.length,
        **percentiles("picture_age", ages, (50, 95)),
    }


def tables(run: MiddlewareRun) -> dict[str, list[Row]]:
    """Return a row of the run, and one of each command and picture."""
    scenario = run.scenario
    window = run.window
    sent = _times(run.near, NoteKind.SENT)
    refused = {note.number for note in run.near if note.kind is NoteKind.REFUSED}
    heard = [note for note in run.far if note.kind is NoteKind.APPLIED]
    taken = _times(run.far, NoteKind.PICTURE_TAKEN)
    pictures = [note for note in run.near if note.kind is NoteKind.PICTURE_SHOWN]
    ready = [note.time for note in run.near if note.kind is NoteKind.READY]
    link = run.link
    row = {
        "connected": int(bool(ready)),
        "connected_after_s": ready[0] - run.window.start if ready else math.nan,
        "commands": sum(window.since <= time < window.until for time in sent.values()),
        "not_taken": len(refused),
        **command_row(
            _floats(sent[note.number] for note in heard),
            _floats(note.time for note in heard),
            window,
            max_age_s=scenario.robot.max_age_s,
            watchdog_s=scenario.robot.watchdog_s,
        ),
        **picture_row(
            _floats(taken[note.number] for note in pictures),
            _floats(note.time for note in pictures),
            window,
        ),
        "up_bytes": link.up.passed_bytes,
        "down_bytes": link.down.passed_bytes,
        "late_p99_s": link.late_p99_s,
        "late_max_s": link.late_max_s,
        "attempts": run.attempts,
        "disturbed": int(run.is_disturbed),
        "load": run.load,
    }
    return {
        "runs": [row],
        "commands": _fates(
            sent, compress(heard, is_applied([note.number for note in heard])), window
        ),
        "pictures": _fates(taken, pictures, window),
    }


def _times(notes: list[Note], kind: NoteKind) -> dict[int, float]:
    """Return when each command or picture of some notes was made [s], by number."""
    return {note.number: note.time for note in notes if note.kind is kind}


def _fates(made: dict[int, float], arrived: Iterable[Note], window: Window) -> list[Row]:
    """Return when each was made and arrived, in the run's time; nan for what never arrived."""
    arrivals = {note.number: note.time - window.start for note in arrived}
    return [
        {
            "number": number,
            "made_s": time - window.start,
            "arrived_s": arrivals.get(number, math.nan),
        }
        for number, time in made.items()
    ]


def _floats(values: Iterable[float]) -> Floats:
    return np.array(list(values), dtype=float)
