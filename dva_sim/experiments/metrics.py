"""From a recording to rows: every measure is defined here, once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.core.events import Event
from dva_sim.recorder import Applied, DriveLog
from dva_sim.simulation import Recording

Row = dict[str, Any]
NAN = math.nan
QUANTILES = (5, 25, 50, 75, 95)


def run_row(recording: Recording) -> Row:
    """One row per run: its first drive, and what concerns the whole run."""
    drives = recording.recorder.drives
    row: Row = drive_measures(drives[0], recording) if drives else {}
    exposure = recording.recorder.exposure
    row["events"] = len(recording.events)
    row["person_exposure_s"] = float(sum(exposure.values()))
    row["replans"] = recording.recorder.counters["replans"]
    row["messages"] = recording.recorder.counters["messages"]
    row["bytes"] = recording.recorder.counters["bytes"]
    row["refused"] = recording.recorder.counters["refused"]
    row["violations"] = sum(recording.recorder.violations.values())
    row["simulated_s"] = recording.duration
    return row


def drive_measures(drive: DriveLog, recording: Recording) -> Row:
    """Measures of one drive; times in [s].

    `drive_time_s` runs from the order to the confirmation; the horizon stands for a drive
    that never got there, which `confirmed` and `outcome` tell.
    """
    confirmed = drive.outcome == "confirmed"
    ended = drive.ended if drive.ended is not None else recording.duration
    time = ended - drive.ordered if confirmed else recording.scenario.horizon_s - drive.ordered
    body = recording.robots[drive.robot].body
    driving = ended - drive.started if drive.started is not None else NAN
    row: Row = {
        "confirmed": confirmed,
        "outcome": drive.outcome,
        "drive_time_s": time,
        "path_m": body.distance,
    }
    row |= command_ages(drive.applied, ended)
    row |= {
        "command_rate_hz": len(drive.applied) / driving if driving else NAN,
        "commands_sent": drive.sent,
        "commands_applied": len(drive.applied),
        "commands_stale": recording.recorder.counters["robot refused: stale"],
        "commands_superseded": drive.superseded + recording.robots[drive.robot].inbox.superseded,
        "round_trip_p50_s": float(np.median(drive.round_trips)) if drive.round_trips else NAN,
        "queue_max": recording.robots[drive.robot].inbox.longest,
        "timeouts": drive.timeouts,
        "alerts": drive.alerts,
        "stop_share": drive.safe_stop / driving if driving else NAN,
        "contacts": body.contacts,
        "contact_impulse_ns": body.impulse,
    }
    return row | delay_stages(drive, ended)


def command_ages(applied: list[Applied], ended: float) -> Row:
    """Age at application (issue to effect) and in force (averaged over time)."""
    if not applied:
        names = ["mean", *(f"p{q:02}" for q in QUANTILES)]
        empty: Row = {f"command_age_{n}_s": NAN for n in names}
        return empty | {"age_in_force_mean_s": NAN}
    ages = np.array([a.time - a.issued for a in applied])
    row: Row = {"command_age_mean_s": float(ages.mean())}
    for q, value in zip(QUANTILES, np.percentile(ages, QUANTILES), strict=True):
        row[f"command_age_p{q:02}_s"] = float(value)
    hold = _holds(applied, ended)
    total = float(hold.sum())
    in_force = float((hold * (ages + hold / 2)).sum() / total) if total else NAN
    return row | {"age_in_force_mean_s": in_force}


def _holds(applied: list[Applied], ended: float) -> NDArray[np.float64]:
    """How long each command stood until the next, shape `(n,)` [s]."""
    times = np.array([*(a.time for a in applied), max(ended, applied[-1].time)])
    return np.diff(times)


def delay_stages(drive: DriveLog, ended: float) -> Row:
    """The loop's delay as a sum of mean stages, from a frame's capture to its effect.

    Each is an average over the drive: frame (half the time until the next one is shown) and
    downlink are per frame, human is the person's perception and hand, filter, uplink and
    processing are per command, sampling is half the hold of a command, weighted by time.
    """
    stages: Row = {f"delay_{s}_s": NAN for s in STAGES}
    if drive.applied and len(drive.frame_times) > 1:
        captured, shown = np.array(drive.frame_times).T
        gaps, hold = np.diff(shown), _holds(drive.applied, ended)
        stages = {
            "delay_frame_s": _half_hold(gaps),
            "delay_downlink_s": float((shown - captured).mean()),
            "delay_human_s": drive.human_delay,
            "delay_filter_s": float(np.mean([a.sample_age for a in drive.applied])),
            "delay_uplink_s": float(np.mean([a.arrived - a.issued for a in drive.applied])),
            "delay_processing_s": float(np.mean([a.time - a.arrived for a in drive.applied])),
            "delay_sampling_s": _half_hold(hold),
        }
        stages["frame_age_mean_s"] = stages["delay_downlink_s"] + stages["delay_frame_s"]
    stages.setdefault("frame_age_mean_s", NAN)
    stages["loop_delay_mean_s"] = sum(stages[f"delay_{s}_s"] for s in STAGES)
    return stages


STAGES = ("frame", "downlink", "human", "filter", "uplink", "processing", "sampling")


def _half_hold(gaps: NDArray[np.float64]) -> float:
    """Mean age that holding a value adds at a random moment: E[g^2] / 2 E[g]."""
    total = float(gaps.sum())
    return float((gaps**2).sum() / (2 * total)) if total else NAN


def event_rows(recording: Recording) -> list[Row]:
    """One row per event that happened, in order; none is left out (S6)."""
    return [_event_row(recording, number) for number in range(len(recording.incidents))]


def _event_row(recording: Recording, number: int) -> Row:
    incident = recording.incidents[number]
    event = recording.event_of(number)
    row: Row = {
        "event_id": number + 1,
        "kind": incident.kind,
        "room": incident.room,
        "responder_kind": "none",
        "responder": "",
        "outcome": "undetected",
        "t_occurred_s": incident.start,
    }
    times = event.times if event else {}
    for step in ("detected", "assigned", "departed", "arrived", "confirmed"):
        row[f"t_{step}_s"] = times.get(step, NAN)
    if event is not None:
        row["outcome"] = outcome_of(event)
        if event.responder is not None:
            row["responder_kind"] = "robot" if event.operator else "guard"
            row["responder"] = recording.labels[event.responder]
    row["response_s"] = row["t_arrived_s"] - row["t_detected_s"]
    row["confirmation_s"] = row["t_confirmed_s"] - row["t_detected_s"]
    return row


def outcome_of(event: Event) -> str:
    """`confirmed`, `refuted`, `escalated`, `expired`, or `open` at the horizon."""
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
