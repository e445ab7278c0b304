"""Where the delay comes from, from a picture's capture to its effect, as a sum that is checked.

At each moment of a drive a command is in force that rests on pictures captured some time ago.
How long ago, averaged over the time that commands were in force, is the observation-to-effect
delay. It is found twice. *Measured*: the time of capture travels with what is wanted through hand
and filter into each command, so that the delay is read off. *As a sum*: each stage is taken from
its own records, at the same moments and with the same weights, since means add up only then.
What holds a value (a frame until the next, a command until the next) counts once, at its place.
The motors are in both with their time constant.

From a recording to rows: every measure is defined here, once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.people.bystander import DOWN
from dva_sim.core.events import Event
from dva_sim.kernel.recorder import Applied, DriveLog
from dva_sim.simulation.full import Recording, workload
from dva_sim.simulation.scenario import Scenario

Floats = NDArray[np.float64]
Row = dict[str, Any]
NAN = math.nan
QUANTILES = (5, 25, 50, 75, 95)

STAGES = (
    *("frame", "downlink", "human", "hand", "filter"),
    *("sampling", "pattern", "uplink", "processing", "motor"),
)

_COUNT = 64
_LEFT = np.linspace(1.0, 0.0, _COUNT + 1)
# How long ago, in time constants, a first-order lag got what it holds: the mean of each of equal
# shares of it, so that the mean of all is one (the integral of -log v is v - v log v).
_REMEMBERED = -_COUNT * np.diff(_LEFT - _LEFT * np.log(np.maximum(_LEFT, 1e-300)))
_REMEMBERED /= _REMEMBERED.mean()


class Driven(NamedTuple):
    """A drive as far as its commands had an effect.

    Attributes:
        log: Of the drive.
        applied: What took effect before its end.
        hold: How long each of them was in force, shape `(n,)` [s].
    """

    log: DriveLog
    applied: Sequence[Applied]
    hold: Floats


def driven(log: DriveLog, end: float) -> Driven:
    """The commands made in a drive that took effect until `end` [s], and for how long.

    Of the drive before, some may still have been under way.
    """
    start = math.inf if log.started is None else log.started
    applied = [a for a in log.applied if a.issued >= start and a.time <= end]
    times = np.array([*(a.time for a in applied), end])
    until = np.array([a.until for a in applied])
    return Driven(log, applied, np.maximum(np.minimum(times[1:], until) - times[:-1], 0.0))


def command_ages(drives: Sequence[Driven]) -> Row:
    """Age of commands at application (made to effect), and in force (averaged over time)."""
    ages = np.array([a.time - a.issued for drive in drives for a in drive.applied])
    row: Row = {"command_age_mean_s": float(ages.mean()) if len(ages) else NAN}
    for q in QUANTILES:
        row[f"command_age_p{q:02}_s"] = float(np.percentile(ages, q)) if len(ages) else NAN
    hold = np.concatenate([drive.hold for drive in drives])
    return row | {"age_in_force_mean_s": _mean(ages + hold / 2, hold)}


def delay_budget(drives: Sequence[Driven], motor: float) -> Row:
    """The mean of each stage, their sum, and the whole as it was measured.

    Nothing (nan) where no command rests on a picture: nobody tilts, or the filter is frozen.

    Args:
        drives: Those of one event.
        motor: Time constant of the robot's motors [s].
    """
    parts = [_stages(drive) for drive in drives if drive.log.intents and drive.applied]
    *stages, measured, hold = np.concatenate([np.empty((0, len(STAGES) + 1)), *parts]).T
    motor = motor if hold.any() else NAN
    means = [*(_mean(stage, hold) for stage in stages), motor]
    row: Row = {f"delay_{name}_s": mean for name, mean in zip(STAGES, means, strict=True)}
    row["frame_age_mean_s"] = row["delay_frame_s"] + row["delay_downlink_s"]
    row["loop_delay_mean_s"] = sum(means)
    row["loop_delay_measured_s"] = _mean(measured, hold) + motor
    return row


def _stages(drive: Driven) -> Floats:
    """Of each command: its stages but the motors, the whole as measured, its weight [s].

    The pictures behind a command are looked up at the moments that the hand still remembers
    when the filter takes its value. Commands from before the first picture are left out.

    Returns:
        Shape `(n, 11)`: the stages in order, the whole, the time in force.
    """
    log, hold = drive.log, drive.hold
    made = np.array([(a.issued, a.sent, a.arrived, a.time) for a in drive.applied])
    issued, sent, arrived, time = made.T
    sample_age, captured = np.array([(a.sample_age, a.captured) for a in drive.applied]).T
    moments = (issued - sample_age)[:, np.newaxis] - log.hand_lag * _REMEMBERED
    # What is wanted at a moment is followed after it.
    number = np.searchsorted([intent.time for intent in log.intents], moments, side="left") - 1
    taken, shown, wanted = np.moveaxis(np.array(log.intents)[number], -1, 0)
    columns = (
        *(s.mean(axis=1) for s in (moments - wanted, shown - taken, wanted - shown)),
        *(np.full(len(hold), log.hand_lag), sample_age, hold / 2),
        *(sent - issued, arrived - sent, time - arrived),
        *(time + hold / 2 - captured, hold),
    )
    table = np.stack(columns, axis=1)
    known: Floats = table[number[:, -1] >= 0]
    return known


def _mean(values: Floats, weights: Floats) -> float:
    """Weighted mean; nan where nothing has a weight."""
    total = float(weights.sum())
    return float((values * weights).sum() / total) if total else NAN


SETTLED = "confirmed", "contained", "refuted"  # outcomes of events that somebody has looked at

_OF_DRIVES = (
    *("confirmed", "drive_time_s", "attempts"),
    *("path_m", "contacts", "contact_impulse_n_s", "person_contacts", "jams"),
    *("command_age_mean_s", *(f"command_age_p{q:02}_s" for q in QUANTILES), "age_in_force_mean_s"),
    *(f"delay_{stage}_s" for stage in STAGES),
    *("frame_age_mean_s", "loop_delay_mean_s", "loop_delay_measured_s"),
    *("command_rate_hz", "commands_sent", "commands_applied", "commands_stale"),
    *("commands_superseded", "round_trip_p50_s", "round_trip_p95_s", "round_trip_max_s"),
    *("samples_per_value", "queue_max", "timeouts", "alerts", "stop_share"),
)
_OF_PEOPLE = ("dose_heat_max", "dose_toxic_max", "incapacitated")
_OF_BYSTANDERS = ("evacuated_share", "evacuated_s")
_OF_OPERATORS = (
    *("utilisation", "attending_share", "queue_mean", "turns_per_min"),
    *("reversals_per_min", "command_changes_per_min", "steering_entropy", "waiting_share"),
    *("move_waits", "move_and_wait_share", "path_error_rms_m", "path_error_max_m"),
    *("missed", "false_confirmations"),
)
MEASURES = (
    *_OF_DRIVES,
    *("response_mean_s", "confirmation_mean_s", "settled_per_min"),
    *("events", "person_exposure_s", *_OF_PEOPLE, *_OF_BYSTANDERS, *_OF_OPERATORS),
    *("replans", "messages", "traffic_bytes", "refused"),
    *("plugin_failures", "violations", "simulated_s"),
)
"""Numbers that a row of `run_row` may hold, and so what a study may ask for."""


def measures_of(scenario: Scenario) -> tuple[str, ...]:
    """Those of `MEASURES` that a run of a scenario may hold: without robots nobody drives one."""
    bystanders, guards = scenario.bystander.count, scenario.guard.count
    there = {_OF_DRIVES: scenario.robot.count, _OF_OPERATORS: scenario.operator.count}
    there |= {_OF_PEOPLE: bystanders + guards, _OF_BYSTANDERS: bystanders}
    gone = {name for names, count in there.items() if not count for name in names}
    return tuple(name for name in MEASURES if name not in gone)


def run_row(recording: Recording) -> Row:
    """One row per run: the drives to its first event, and what concerns the whole run."""
    row = drive_measures(recording)
    exposure = recording.recorder.exposure
    row["events"] = len(recording.events)
    row["person_exposure_s"] = float(sum(exposure.values()))
    row |= (
        _event_measures(recording) | _people_measures(recording) | workload.run_measures(recording)
    )
    row["replans"] = recording.recorder.counters["replans"]
    row["messages"] = recording.recorder.counters["messages"]
    row["traffic_bytes"] = recording.recorder.counters["bytes"]
    row["refused"] = recording.recorder.counters["refused"]
    row["plugin_failures"] = plugin_failures(recording)
    row["violations"] = sum(recording.recorder.violations.values())
    row["simulated_s"] = recording.duration
    row["network_depth"] = recording.depth
    return row


def _event_measures(recording: Recording) -> Row:
    """Of all events that the DVA knew; the whole horizon stands for what never came.

    False alarms are responded to, and never confirmed: only response counts them.
    """
    rows = [row for row in event_rows(recording) if row["t_detected_s"] < math.inf]
    real = [row for row in rows if row["is_true"]]
    settled = sum(row["outcome"] in SETTLED for row in rows)
    return {
        "response_mean_s": _mean_or(recording.scenario.horizon_s, rows, "response_s"),
        "confirmation_mean_s": _mean_or(recording.scenario.horizon_s, real, "confirmation_s"),
        "settled_per_min": 60.0 * settled / recording.duration,
    }


def _mean_or(instead: float, rows: list[Row], column: str) -> float:
    """Mean of a column, with something instead of what is missing; nan without rows."""
    values = [instead if math.isnan(row[column]) else row[column] for row in rows]
    return float(np.mean(values)) if values else NAN


def plugin_failures(recording: Recording) -> int:
    """How often an operator, filter, mapping or drive of a user gave no answer that is one."""
    counted = recording.recorder.counters.items()
    return sum(count for what, count in counted if what.startswith("failed: an answer of "))


def _people_measures(recording: Recording) -> Row:
    """Of all who are on foot; nothing where there is nobody."""
    people = recording.people
    if not people:
        return {}
    bystanders = [p for p in people if p.kind == "bystander"]
    out = [p.out for p in bystanders if p.out < math.inf]
    row: Row = {
        "dose_heat_max": max(p.heat for p in people),
        "dose_toxic_max": max(p.toxic for p in people),
        "incapacitated": sum(p.activity == DOWN for p in people),
    }
    if bystanders:
        row["evacuated_share"] = len(out) / len(bystanders)
        row["evacuated_s"] = max(out, default=NAN)
    return row


def people_rows(recording: Recording) -> list[Row]:
    """One row per guard and bystander; times that never came are missing."""
    return [
        {
            "person_name": p.name,
            "kind": p.kind,
            "activity": p.activity,
            "exposure_s": p.exposure,
            "dose_heat": p.heat,
            "dose_toxic": p.toxic,
            "t_leaves_s": p.leaves if p.leaves < math.inf else NAN,
            "t_out_s": p.out if p.out < math.inf else NAN,
        }
        for p in recording.people
    ]


def drive_measures(recording: Recording) -> Row:
    """Measures of driving to the event of the run's first drive; times in [s].

    `drive_time_s` runs from the first order to the confirmation, over all attempts and their
    operators. The whole horizon stands for an event that no robot confirmed, be it that none
    could be driven; `confirmed` and `outcome` tell. Where guards can go instead, a run
    without any drive has no such measures.
    """
    drives = recording.recorder.drives
    if not drives:
        lost = not recording.scenario.guard.count
        horizon = recording.scenario.horizon_s
        return {"confirmed": False, "outcome": "no drive", "drive_time_s": horizon} if lost else {}
    attempts = [d for d in drives if d.event == drives[0].event]
    first, last = attempts[0], attempts[-1]
    ended = last.ended if last.ended is not None else recording.duration
    confirmed = last.outcome == "confirmed"
    time = ended - first.ordered if confirmed else recording.scenario.horizon_s
    row: Row = {"confirmed": confirmed, "outcome": last.outcome, "drive_time_s": time}
    row |= {"attempts": len(attempts)} | _body_measures(attempts, recording)
    row["cause"] = "" if confirmed else _cause(row, attempts, recording)
    return row | _command_measures(attempts, recording)


def _cause(row: Row, attempts: list[DriveLog], recording: Recording) -> str:
    """Why an event was not confirmed: a robot without power or jammed, else how it ended."""
    bodies = [recording.robots[drive.robot].body for drive in attempts]
    if not all(body.powered for body in bodies):
        return "battery"
    return "jammed" if row["jams"] else str(row["outcome"])


def _body_measures(attempts: list[DriveLog], recording: Recording) -> Row:
    """What the robots' bodies went through."""
    bodies = [recording.robots[robot].body for robot in sorted({d.robot for d in attempts})]
    return {
        "path_m": sum(body.distance for body in bodies),
        "contacts": sum(body.contacts for body in bodies),
        "contact_impulse_n_s": sum(body.impulse for body in bodies),
        "person_contacts": sum(body.person_contacts for body in bodies),
        "jams": sum(body.jams for body in bodies),
    }


def _command_measures(attempts: list[DriveLog], recording: Recording) -> Row:
    """Age, rate and fate of the commands of all attempts."""
    spans = [_span(d, recording) for d in attempts]
    driving = sum(end - start for start, end in spans)
    drives = [driven(d, end) for d, (_, end) in zip(attempts, spans, strict=True)]
    applied, in_force = sum(len(d.applied) for d in drives), sum(d.hold.sum() for d in drives)
    trips = [t for d in attempts for t in d.round_trips]
    inboxes = [recording.robots[robot].inbox for robot in sorted({d.robot for d in attempts})]
    if not any(d.sent for d in attempts):
        driving = 0.0  # nobody drove: the robot was on a mission
    motor = recording.robots[attempts[0].robot].body.spec.motor_time_constant
    return (
        command_ages(drives)
        | delay_budget(drives, motor)
        | {
            "command_rate_hz": applied / driving if driving else NAN,
            "commands_sent": sum(d.sent for d in attempts),
            "commands_applied": applied,
            "commands_stale": recording.recorder.counters["robot refused: stale"],
            "commands_superseded": sum(d.superseded for d in attempts)
            + sum(inbox.superseded for inbox in inboxes),
            **_round_trips(trips),
            "samples_per_value": _ratio(
                sum(d.samples for d in attempts), sum(d.values for d in attempts)
            ),
            "queue_max": max(inbox.longest for inbox in inboxes),
            "timeouts": sum(d.timeouts for d in attempts),
            "alerts": sum(d.alerts for d in attempts),
            "stop_share": 1.0 - float(in_force) / driving if driving else NAN,
        }
    )


def _round_trips(trips: list[float]) -> Row:
    """From a command's request to its reply."""
    return {
        "round_trip_p50_s": float(np.median(trips)) if trips else NAN,
        "round_trip_p95_s": float(np.percentile(trips, 95)) if trips else NAN,
        "round_trip_max_s": max(trips, default=NAN),
    }


def _ratio(amount: float, of: float) -> float:
    return amount / of if of else NAN


def _span(drive: DriveLog, recording: Recording) -> tuple[float, float]:
    """From when to when a drive was under way [s]; nothing if it never started."""
    end = drive.ended if drive.ended is not None else recording.duration
    return (drive.started if drive.started is not None else end), end


def event_rows(recording: Recording) -> list[Row]:
    """One row per event that happened, in order; none is left out (S6).

    The columns `outcome`, `confirmation_s`, `closing_s` and `watched_s` are what competing
    outcomes are estimated from, as for the timed model: see `dispatch.measures.fates`.
    """
    return [_event_row(recording, number) for number in range(len(recording.incidents))]


def _event_row(recording: Recording, number: int) -> Row:
    incident = recording.incidents[number]
    event = recording.event_of(number)
    row: Row = {
        "event_id": number + 1,
        "kind": incident.kind,
        "room": incident.room,
        "is_true": not incident.false_alarm,
        "responder_kind": "none",
        "responder": "",
        "outcome": "undetected",
        "t_occurred_s": incident.start,
    }
    times = event.times if event else {}
    for step in ("detected", "assigned", "departed", "arrived", "confirmed", "contained", "closed"):
        row[f"t_{step}_s"] = times.get(step, NAN)
    if event is not None:
        row["outcome"] = outcome_of(event)
        if event.responder is not None:
            row["responder_kind"] = "robot" if event.operator else "guard"
            row["responder"] = recording.labels[event.responder]
    row["response_s"] = row["t_arrived_s"] - row["t_detected_s"]
    row["confirmation_s"] = row["t_confirmed_s"] - row["t_detected_s"]
    row["containment_s"] = row["t_contained_s"] - row["t_detected_s"]
    row["closing_s"] = row["t_closed_s"] - row["t_detected_s"]
    row["watched_s"] = recording.duration - row["t_detected_s"]
    row["missed"] = (
        event is not None
        and row["outcome"] == "refuted"
        and workload.was_there(recording, event.number, row["t_closed_s"])
    )
    row["false_confirmation"] = incident.false_alarm and row["t_confirmed_s"] < math.inf
    return row


def outcome_of(event: Event) -> str:
    """`confirmed`, `contained`, `refuted`, `escalated`, `expired`, or `open` at the horizon."""
    return "open" if event.open else event.state.value


def track_rows(recording: Recording) -> list[Row]:
    """Where the robots were, one row per sampled moment."""
    return [
        {
            "agent": agent,
            "t_s": point.time,
            "x_m": point.x,
            "y_m": point.y,
            "heading_rad": point.heading,
            "mode": point.mode,
        }
        for agent, points in recording.recorder.tracks.items()
        if agent.startswith("robot")
        for point in points
    ]
