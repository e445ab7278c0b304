"""From a run of the full model to rows: what each column means, and how it is found."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from dva_sim.agents.people.bystander import INCAPACITATED
from dva_sim.core.events import Event
from dva_sim.kernel.measure import Measure, names_of, text
from dva_sim.kernel.recorder import DriveLog
from dva_sim.simulation.full import Recording
from dva_sim.simulation.full.recording import RobotLog
from dva_sim.simulation.measures import decisions, loop_delay, workload
from dva_sim.simulation.measures.commands import (
    COMMAND_RATE,
    NAN,
    ROUND_TRIP_P50,
    ROUND_TRIP_P95,
    Row,
    percentiles,
    ratio,
    restricted_mean,
)
from dva_sim.simulation.measures.loop_delay import command_ages, delay_budget, driven
from dva_sim.simulation.scenario import Scenario

SETTLED = "confirmed", "contained", "refuted"  # outcomes of events that somebody has looked at

_BODY = (
    Measure("path_m", "way of the robots that were driven", title="path length"),
    Measure(
        "contacts",
        "contacts of these robots with walls and others",
        title="contacts with walls and others",
    ),
    Measure("contact_impulse_n_s", "impulse of all contacts", title="impulse of all contacts"),
    Measure("person_contacts", "contacts with people", title="contacts with people"),
    Measure("jams", "times that a robot was jammed"),
)
_OF_DRIVES = (
    Measure(
        "confirmed", "whether the first driven event was confirmed", better="large", low=0, high=1
    ),
    text("outcome", "how the last drive to it ended"),
    Measure(
        "drive_time_s",
        "first order to confirmation, over all attempts; else the whole horizon",
        title="driving time to confirmation",
        awaits="confirmation",
    ),
    Measure("attempts", "drives to the event"),
    *_BODY,
    text("cause", "why it was not confirmed; empty if it was"),
    *loop_delay.COLUMNS,
    COMMAND_RATE,
    Measure("commands_sent", "commands that the phone sent"),
    Measure("commands_applied", "commands that took effect", better="large"),
    Measure("commands_stale", "commands that a robot refused as too old"),
    Measure("commands_superseded", "commands that a newer one replaced before they took effect"),
    ROUND_TRIP_P50,
    ROUND_TRIP_P95,
    Measure("round_trip_max_s", "longest such time", title="longest time from request to answer"),
    Measure(
        "samples_per_value",
        "accelerometer samples in a batch of the phone's filter, mean",
        title="accelerometer samples per value of the filter",
    ),
    Measure("queue_max", "most commands that waited at a robot"),
    Measure("timeouts", "requests whose answer did not come in time"),
    Measure("alerts", "alerts of the phone that the link may be lost"),
    Measure(
        "stop_share",
        "share of the driving time without a command in force",
        title="share of driving time in safe stop",
    ),
)
_OF_PEOPLE = (
    Measure("dose_heat_max", "largest fractional effective dose of heat; 1 incapacitates"),
    Measure("dose_toxic_max", "largest fractional effective dose of toxic gas; 1 incapacitates"),
    Measure("incapacitated", "people incapacitated"),
)
_OF_BYSTANDERS = (
    Measure("evacuated_share", "share of bystanders evacuated", better="large"),
    Measure(
        "evacuated_s",
        "when the last of those who got out was out",
        title="time until the last one is out",
    ),
)
_OF_DISTURBANCES = (
    Measure(
        "driven_on_s",
        "from the disturbance of the first drive until its operator knows; to the end if never",
        title="time driven on in vain",
    ),
    Measure("commands_in_vain", "commands sent in that time", title="commands sent in vain"),
    Measure("alerted", "whether the app alerted", low=0, high=1, better="large"),
    text("drive_outcome", "how the disturbed drive ended"),
)
RUN_COLUMNS = (
    *_OF_DRIVES,
    *_OF_DISTURBANCES,
    Measure(
        "response_mean_s",
        "first report to somebody on scene, mean; the horizon where never",
        title="restricted mean time to response",
        awaits="response",
    ),
    Measure(
        "confirmation_mean_s",
        "first report to confirmation of true ones, mean; the horizon if never",
        title="restricted mean time to confirmation",
        awaits="confirmation",
    ),
    Measure(
        "settled_per_min",
        "events confirmed, contained or refuted per minute of the run",
        title="rate of events settled",
        better="large",
    ),
    Measure("events", "events that the DVA knew of"),
    Measure(
        "person_exposure_s",
        "time of people within danger radii, summed over people",
        title="time of people in danger",
    ),
    *_OF_PEOPLE,
    *_OF_BYSTANDERS,
    *workload.COLUMNS,
    Measure("replans", "ways that were planned again"),
    Measure("messages", "messages on the network"),
    Measure("traffic_bytes", "size of all messages on the network"),
    Measure("refused", "requests that were refused"),
    text("network_depth", "how closely the network was modelled: message, segment or datagram"),
    Measure("plugin_failures", "invalid answers of a user's class"),
    Measure(
        "violations",
        "broken safety rules found, of S1 to S7; see docs/explanation/safety-rules.md",
    ),
    Measure("simulated_s", "virtual time simulated"),
    *decisions.RUN_COLUMNS,
)
"""Columns of `run_row`; a study may ask for those that are numbers."""
_STEPS = {
    "detected": "when it was detected",
    "assigned": "when it was assigned",
    "departed": "when the responder set out",
    "arrived": "when the responder was on scene",
    "confirmed": "when it was confirmed",
    "contained": "when it was contained",
    "closed": "when it was closed",
}
EVENT_COLUMNS = (
    Measure("event_id", "number of the event in its run, from 1"),
    text("kind", "of the event"),
    text("room", "where it was"),
    Measure("is_true", "whether it is no false alarm"),
    text("responder_kind", "who was sent last: robot, guard or none"),
    text("responder", "its name"),
    text("outcome", "confirmed, contained, refuted, escalated, expired, open or undetected"),
    Measure("t_occurred_s", "when it began"),
    *(Measure(f"t_{step}_s", meaning) for step, meaning in _STEPS.items()),
    Measure(
        "response_s",
        "detection until somebody is on scene, or has confirmed it",
        title="response time",
    ),
    Measure("confirmation_s", "detection until it is confirmed", title="confirmation time"),
    Measure("containment_s", "detection until it is contained"),
    Measure("closing_s", "detection until it is closed"),
    Measure("watched_s", "detection to the end of observation, which is that of the run"),
    Measure("missed", "whether it was refuted although it was there"),
    Measure("false_confirmation", "whether it was confirmed although nothing was there"),
    *decisions.EVENT_COLUMNS,
)
PEOPLE_COLUMNS = (
    text("person_name", "guard or bystander"),
    text("kind", "guard or bystander"),
    text("activity", "at the end of the run"),
    Measure("exposure_s", "time within danger radii"),
    Measure("dose_heat", "fractional effective dose of heat; 1 incapacitates"),
    Measure("dose_toxic", "fractional effective dose of toxic gas; 1 incapacitates"),
    Measure("t_leaves_s", "when it set out to leave"),
    Measure("t_out_s", "when it was out"),
)
TRACK_COLUMNS = (
    text("agent", "robot"),
    Measure("t_s", "time of the run"),
    Measure("x_m", "place, to the east", low=-math.inf),
    Measure("y_m", "place, to the north", low=-math.inf),
    Measure("heading_rad", "anticlockwise from east"),
    text("mode", "of the robot"),
)


def measures_of(scenario: Scenario) -> tuple[str, ...]:
    """Return the measures that a run of a scenario may hold: without robots nobody drives one."""
    bystanders = scenario.bystander.count
    guards = scenario.guard.count
    has_rows = {_OF_DRIVES: scenario.robot.count, workload.COLUMNS: scenario.operator.count}
    has_rows[_OF_DISTURBANCES] = scenario.disturbance.kind != "none"
    has_rows |= {_OF_PEOPLE: bystanders + guards, _OF_BYSTANDERS: bystanders}
    has_rows[decisions.RUN_COLUMNS] = scenario.dispatch.person is not None
    gone = {column for columns, count in has_rows.items() if not count for column in columns}
    return names_of(column for column in RUN_COLUMNS if column not in gone)


def run_row(recording: Recording) -> Row:
    """Return one row per run: the drives to its first event, and what concerns the whole run."""
    row = drive_measures(recording)
    exposure = recording.recorder.exposure
    row["events"] = len(recording.events)
    row["person_exposure_s"] = float(sum(exposure.values()))
    row |= (
        _event_measures(recording) | _people_measures(recording) | workload.run_measures(recording)
    )
    row |= _disturbance_measures(recording)
    recorder = recording.recorder
    row |= {"replans": recorder.counters["replans"], "messages": recorder.messages}
    row |= {"traffic_bytes": recorder.bytes, "refused": recorder.counters["refused"]}
    row["plugin_failures"] = plugin_failures(recording)
    row["violations"] = sum(recording.recorder.violations.values())
    row["simulated_s"] = recording.duration
    row["network_depth"] = recording.depth
    if recording.people_decide:
        row |= decisions.run_measures(recording)
    return row


def _disturbance_measures(recording: Recording) -> Row:
    """Return the measures of the first drive, if it was disturbed before it ended."""
    if recording.scenario.disturbance.kind == "none" or not recording.recorder.drives:
        return {}
    drive = recording.recorder.drives[0]
    if (since := drive.disturbed) is None:
        return {}
    until = drive.ended if drive.ended is not None else recording.duration
    return {
        "driven_on_s": until - since,
        "commands_in_vain": sum(made >= since for made, _, _ in drive.commands),
        "alerted": drive.alerts > 0,
        "drive_outcome": drive.outcome,
    }


def _event_measures(recording: Recording) -> Row:
    """Return the measures of all events that the DVA knew; the horizon stands for missing times.

    False alarms are responded to, and never confirmed: only response counts them.
    """
    rows = [row for row in event_rows(recording) if row["t_detected_s"] < math.inf]
    real = [row for row in rows if row["is_true"]]
    settled = sum(row["outcome"] in SETTLED for row in rows)
    horizon = recording.scenario.horizon_s
    return {
        "response_mean_s": restricted_mean([row["response_s"] for row in rows], horizon),
        "confirmation_mean_s": restricted_mean([row["confirmation_s"] for row in real], horizon),
        "settled_per_min": 60.0 * settled / recording.duration,
    }


def plugin_failures(recording: Recording) -> int:
    """Count how often a policy, operator, filter, mapping, pattern or drive of a user failed."""
    counted = recording.recorder.counters.items()
    return sum(count for what, count in counted if what.startswith("failed: an answer of "))


def _people_measures(recording: Recording) -> Row:
    """Return the measures of everybody on foot; nothing where there is nobody."""
    people = recording.people
    if not people:
        return {}
    bystanders = [p for p in people if p.kind == "bystander"]
    out = [p.out for p in bystanders if p.out < math.inf]
    row: Row = {
        "dose_heat_max": max(p.heat for p in people),
        "dose_toxic_max": max(p.toxic for p in people),
        "incapacitated": sum(p.activity == INCAPACITATED for p in people),
    }
    if bystanders:
        row["evacuated_share"] = len(out) / len(bystanders)
        row["evacuated_s"] = max(out, default=NAN)
    return row


def people_rows(recording: Recording) -> list[Row]:
    """Return one row per guard and bystander; times that never came are missing."""
    names = [column.name for column in PEOPLE_COLUMNS]
    never = math.inf
    return [
        {name: NAN if value == never else value for name, value in zip(names, log, strict=True)}
        for log in recording.people
    ]


def drive_measures(recording: Recording) -> Row:
    """Return measures of driving to the event of the run's first drive; times in [s].

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
    first = attempts[0]
    last = attempts[-1]
    ended = last.ended if last.ended is not None else recording.duration
    confirmed = last.outcome == "confirmed"
    time = ended - first.ordered if confirmed else recording.scenario.horizon_s
    row: Row = {"confirmed": confirmed, "outcome": last.outcome, "drive_time_s": time}
    row |= {"attempts": len(attempts)} | _body_measures(attempts, recording)
    row["cause"] = "" if confirmed else _cause(row, attempts, recording)
    return row | _command_measures(attempts, recording)


def _cause(row: Row, attempts: list[DriveLog], recording: Recording) -> str:
    """Return why an event was not confirmed: a robot without power or jammed, else how it ended."""
    if not all(robot.powered for robot in _robots_of(attempts, recording)):
        return "battery"
    return "jammed" if row["jams"] > 0 else str(row["outcome"])


def _robots_of(attempts: list[DriveLog], recording: Recording) -> list[RobotLog]:
    """Return the measures of the robots driven; of robots of other makes there are none."""
    driven_robots = sorted({drive.robot for drive in attempts})
    return [recording.robots[robot] for robot in driven_robots if robot in recording.robots]


def _body_measures(attempts: list[DriveLog], recording: Recording) -> Row:
    """Return the measures of the robots' bodies."""
    robots = _robots_of(attempts, recording)
    if not robots:
        return dict.fromkeys(names_of(_BODY), NAN)
    return {
        "path_m": sum(robot.distance for robot in robots),
        "contacts": sum(robot.contacts for robot in robots),
        "contact_impulse_n_s": sum(robot.impulse for robot in robots),
        "person_contacts": sum(robot.person_contacts for robot in robots),
        "jams": sum(robot.jams for robot in robots),
    }


def _command_measures(attempts: list[DriveLog], recording: Recording) -> Row:
    """Return the age, rate and fate of the commands of all attempts."""
    spans = [_span(d, recording) for d in attempts]
    driving = sum(end - start for start, end in spans)
    drives = [driven(d, end) for d, (_, end) in zip(attempts, spans, strict=True)]
    applied = sum(len(d.applied) for d in drives)
    in_force = sum(d.hold.sum() for d in drives)
    trips = [t for d in attempts for t in d.round_trips]
    robots = _robots_of(attempts, recording)
    if not any(d.sent for d in attempts):
        driving = 0.0  # nobody drove: the robot was on a mission
    first = recording.robots.get(attempts[0].robot)
    motor = NAN if first is None else first.motor
    return (
        command_ages(drives)
        | delay_budget(drives, motor)
        | {
            "command_rate_hz": ratio(applied, driving),
            "commands_sent": sum(d.sent for d in attempts),
            "commands_applied": applied,
            "commands_stale": recording.recorder.counters["robot refused: stale"],
            "commands_superseded": sum(d.superseded for d in attempts)
            + sum(robot.superseded for robot in robots),
            **percentiles("round_trip", trips, (50, 95)),
            "round_trip_max_s": max(trips, default=NAN),
            "samples_per_value": ratio(
                sum(d.samples for d in attempts), sum(d.values for d in attempts)
            ),
            "queue_max": max((robot.longest_queue for robot in robots), default=NAN),
            "timeouts": sum(d.timeouts for d in attempts),
            "alerts": sum(d.alerts for d in attempts),
            "stop_share": 1.0 - float(in_force) / driving if driving else NAN,
        }
    )


def _span(drive: DriveLog, recording: Recording) -> tuple[float, float]:
    """Return from when to when a drive was under way [s]; nothing if it never started."""
    end = drive.ended if drive.ended is not None else recording.duration
    return (drive.started if drive.started is not None else end), end


def event_rows(recording: Recording) -> list[Row]:
    """Return one row per event that happened, in order; none is left out (S6).

    The columns `outcome`, `confirmation_s`, `closing_s` and `watched_s` are what competing
    outcomes are estimated from, as for the timed model: see `shifts.fates`.
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
    for step in _STEPS:
        row[f"t_{step}_s"] = times.get(step, NAN)
    if event is not None:
        row["outcome"] = outcome_of(event)
        if event.responder is not None:
            row["responder_kind"] = "robot" if event.operator else "guard"
            row["responder"] = recording.label_of(event.responder)
    # A message that tells of an arrival may be lost, but who confirms an event is there.
    row["response_s"] = times.get("arrived", row["t_confirmed_s"]) - row["t_detected_s"]
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
    if recording.people_decide:
        row |= decisions.event_measures(event, recording)
    return row


def outcome_of(event: Event) -> str:
    """`confirmed`, `contained`, `refuted`, `escalated`, `expired`, or `open` at the horizon."""
    return "open" if event.open else event.state.value


def track_rows(recording: Recording) -> list[Row]:
    """Return the positions of the robots, one row per sampled moment."""
    names = [column.name for column in TRACK_COLUMNS]
    return [
        dict(zip(names, (agent, *point), strict=True))
        for agent, points in recording.recorder.tracks.items()
        if agent.startswith("robot")
        for point in points
    ]


TABLES: Final[dict[str, Callable[[Recording], list[Row]]]] = {
    "runs": lambda recording: [run_row(recording)],
    "events": event_rows,
    "people": people_rows,
    "operators": workload.operator_rows,
}
"""Functions that make the tables of a run of the full model, except its tracks."""


def tables_of(recording: Recording) -> dict[str, list[Row]]:
    """Return the tables of a run of the full model, except its tracks."""
    return {name: make(recording) for name, make in TABLES.items()}
