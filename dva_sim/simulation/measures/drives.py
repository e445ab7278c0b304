"""The drives of a run one by one, and their commands: for runs in which people drive."""

from __future__ import annotations

from collections.abc import Iterator

from dva_sim.kernel.measure import Measure, text
from dva_sim.kernel.recorder import DriveLog
from dva_sim.simulation.full.recording import Recording
from dva_sim.simulation.measures.commands import (
    COMMAND_AGE_P50,
    COMMAND_AGE_P95,
    NAN,
    ROUND_TRIP_P50,
    ROUND_TRIP_P95,
    Row,
    percentiles,
)
from dva_sim.simulation.measures.loop_delay import driven

_NUMBER = Measure("drive", "number of the drive in its run, from 1, as they were ordered")
DRIVE_COLUMNS = (
    _NUMBER,
    text("operator_name", "the device that drove, by its kind and number"),
    text("person_label", "who drove, without a name; empty of a simulated person"),
    text("robot_name", "the robot"),
    Measure("event_id", "the event that it was for; 0: none"),
    text("pattern", "what carried the commands"),
    Measure("link_delay_s", "one-way delay of the link, as last set; empty: not modelled"),
    text("pipeline", "how tilt became commands; of a person at a page, the scenario's phone"),
    Measure("sensor_hz", "samples of the person's own phone per second, as measured"),
    Measure("t_ordered_s", "when it was ordered, or a person pressed Start"),
    Measure("t_started_s", "when the robot said that it had begun"),
    Measure("t_ended_s", "when it was over; empty: it went on at the end of the run"),
    text("outcome", "how it ended"),
    Measure("driven_s", "how long it went on"),
    Measure("commands_sent", "commands that were sent"),
    Measure("commands_applied", "commands that took effect", better="large"),
    Measure("commands_superseded", "commands that a newer one replaced before they were sent"),
    Measure("commands_refused", "commands that the robot refused"),
    Measure("timeouts", "requests whose answer did not come in time"),
    Measure("alerts", "alerts that the link may be lost"),
    COMMAND_AGE_P50,
    COMMAND_AGE_P95,
    ROUND_TRIP_P50,
    ROUND_TRIP_P95,
    Measure("stop_share", "share of the driving time without a command in force"),
    Measure("contacts", "contacts of the robot during the drive; empty: not counted"),
    Measure("tour_time_s", "time of the tour's leg that ended in this drive; empty: none did"),
)
COMMAND_COLUMNS = (
    _NUMBER,
    Measure("t_made_s", "when it was made from the tilt"),
    Measure("t_sent_s", "when the pattern let it go"),
    Measure("t_arrived_s", "when it reached the robot"),
    Measure("t_applied_s", "when it took effect"),
    Measure("age_s", "from making to effect"),
    Measure("sample_age_s", "mean age of the tilt samples behind it when it was made"),
)


def drive_rows(recording: Recording) -> list[Row]:
    """Return a row for each drive."""
    return [_drive(recording, *numbered) for numbered in enumerate(recording.recorder.drives, 1)]


def command_rows(recording: Recording) -> list[Row]:
    """Return a row for each command that took effect."""
    logs = enumerate(recording.recorder.drives, 1)
    return [row for number, log in logs for row in _commands(number, log)]


def _drive(recording: Recording, number: int, log: DriveLog) -> Row:
    end = recording.duration if log.ended is None else log.ended
    lasted = 0.0 if log.started is None else end - log.started
    done = driven(log, end)
    by = log.by
    return {
        "drive": number,
        "operator_name": recording.label_of(log.operator),
        "person_label": by.person,
        "robot_name": recording.label_of(log.robot),
        "event_id": log.event,
        "pattern": by.pattern or recording.scenario.pattern,
        "link_delay_s": by.link_delay_s,
        "pipeline": by.pipeline,
        "sensor_hz": by.sensor_hz,
        "t_ordered_s": log.ordered,
        "t_started_s": NAN if log.started is None else log.started,
        "t_ended_s": NAN if log.ended is None else log.ended,
        "outcome": log.outcome if log.ended is not None else "open",
        "driven_s": lasted,
        "commands_sent": log.sent,
        "commands_applied": len(done.applied),
        "commands_superseded": log.superseded,
        "commands_refused": sum(log.refused.values()),
        "timeouts": log.timeouts,
        "alerts": log.alerts,
        **percentiles("command_age", [a.time - a.issued for a in done.applied], (50, 95)),
        **percentiles("round_trip", log.round_trips, (50, 95)),
        "stop_share": 1.0 - float(done.hold.sum()) / lasted if lasted > 0.0 else NAN,
        "contacts": by.contacts,
        "tour_time_s": by.tour_time,
    }


def _commands(number: int, log: DriveLog) -> Iterator[Row]:
    for a in log.applied:
        yield {
            "drive": number,
            "t_made_s": a.issued,
            "t_sent_s": a.sent,
            "t_arrived_s": a.arrived,
            "t_applied_s": a.time,
            "age_s": a.time - a.issued,
            "sample_age_s": a.sample_age,
        }
