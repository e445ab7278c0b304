"""From a timed run to rows: what each column means, and how it is found.

**Cohort**: all events, true ones and false alarms, first reported between the end of the warm-up
and one follow-up before the horizon. Each is followed for the same time T after its first report
(`follow_s`), whatever the policy. So nothing is cut off by the end of the run, and every policy
is judged on the same events. A scenario that drains is followed to the end of every event, and
its cohort ends at the horizon.

**By T**: somebody was on scene (`on_scene_share`); the event was confirmed, refuted (a false
alarm cleared), escalated or expired, or is still open. These shares add up to one.

**Time to X** is a restricted mean: the mean of `min(time, T)`, in which an event that never got
there counts T. Response is for all events, confirmation and containment for the true ones.
Percentiles are over all events of the cohort, never being infinitely late; nan where the
percentile is not reached by T.

Use of the team, its exposure and what the core counted are of the whole measured time, from the
end of the warm-up to the horizon, or (the core's counts) of the whole run.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.measure import Measure, names_of, text
from dva_sim.simulation.measures.commands import Floats, Row, mean
from dva_sim.simulation.timed.bounds import evenness, response_bounds
from dva_sim.simulation.timed.recording import OUTCOMES, TimedRecording, UnitRecord
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.statistics import Incidence, first_of, incidence

FOLLOW_S = 600.0
FATES = ("confirmed", "refuted", "escalated", "expired")
PERCENTILES = (50, 90, 95)
MIN_IN_ZONE = 3  # minimum events for the mean of a zone
SLACK = 1e-6  # rounding error of times [s]

_OF_CONTAINMENT = (
    Measure("contained_share", "share of the true events contained by T", better="large"),
    Measure(
        "containment_mean_s",
        "mean of min(time to containment, T) of true events",
        title="restricted mean time to containment",
    ),
)
RUN_COLUMNS = (
    Measure(
        "follow_s", "time that every event is followed, T; shares and restricted means end there"
    ),
    Measure("events", "events followed"),
    Measure("true_share", "share of the events that are no false alarms"),
    Measure("on_scene_share", "share of the events with somebody on scene by T", better="large"),
    Measure(
        "response_mean_s",
        "mean of min(time to somebody on scene, T)",
        title="restricted mean time to response",
        awaits="response",
        high=FOLLOW_S,
    ),
    Measure(
        "confirmation_mean_s",
        "mean of min(time to confirmation, T) of true events",
        title="restricted mean time to confirmation",
        awaits="confirmation",
        high=FOLLOW_S,
    ),
    *(
        Measure(
            f"response_p{q}_s",
            f"percentile {q} of the time to response",
            title="median time to response"
            if q == 50
            else f"{q}th percentile of the time to response",
        )
        for q in PERCENTILES
    ),
    Measure("robot_share", "share of the events with a response where it was a robot's"),
    *(
        Measure(
            f"{fate}_share",
            f"share of the events {fate} by T, before anything else",
            better="large" if fate in ("confirmed", "refuted") else "small",
        )
        for fate in FATES
    ),
    Measure("open_share", "share of the events still open at T"),
    Measure("escalated_later_share", "share of the events escalated after confirmation, by T"),
    Measure("confirmed_of_true_share", "share of the true events confirmed by T", better="large"),
    *_OF_CONTAINMENT,
    Measure("zone_ratio", "mean response of the worst zone over that of the best"),
    Measure("bound_mean_s", "mean of min(least response time that any policy could have, T)"),
    Measure("beats_bound_share", "share of the events answered sooner than this bound"),
    Measure("use_of_guards", "share of the time measured that guards had an order"),
    Measure("evenness_of_guards", "Jain's index of the guards' work, 1 if all have the same"),
    Measure("use_of_robots", "share of the time measured that robots had an order"),
    Measure("evenness_of_robots", "Jain's index of the robots' work, 1 if all have the same"),
    Measure("use_of_operators", "share of the time measured that operators had an order"),
    Measure("load", "use of the busier of guards and operators"),
    Measure(
        "exposure_s",
        "time of people within danger radii, per event",
        title="exposure of people per event",
    ),
    Measure(
        "exposure_look_s",
        "the part of it spent on finding out, per event",
        title="exposure of people in finding out, per event",
    ),
    Measure("exposure_max_s_per_h", "exposure of the person most exposed, per hour"),
    Measure("preempted", "orders taken back for a more urgent event"),
    Measure("relocated", "guards sent to wait elsewhere"),
    Measure("auctions", "tasks put up for bids"),
    Measure("overruled", "decisions of the policy that the core did not follow"),
    Measure("policy_failed", "times that the policy gave no decision, and the default one decided"),
    Measure("messages", "messages that the DVA took"),
    Measure(
        "violations",
        "broken safety rules found, of S6 and S7; see docs/explanation/safety-rules.md",
    ),
    Measure("simulated_s", "virtual time simulated"),
)
"""Columns of `run_row`, which a study may ask for."""
EVENT_COLUMNS = (
    Measure("event_id", "number of the event in its run, from 1"),
    text("stream", "stream of the demand that it belongs to"),
    text("kind", "of the event"),
    text("zone", "where it was"),
    Measure("is_true", "whether it is no false alarm"),
    Measure("severity", "as reported, from 0 to 1"),
    Measure("shared", "whether it was merged with an earlier one"),
    text("responder", "its name"),
    text("responder_kind", "who was sent last: robot, guard or none"),
    Measure("attempts", "responders sent"),
    Measure("preemptions", "times that its responder was taken away"),
    text("outcome", "confirmed, contained, refuted, escalated, expired or open"),
    Measure("t_detected_s", "when it was detected"),
    Measure("response_s", "first report until somebody is on scene", title="response time"),
    Measure("confirmation_s", "first report until it is confirmed", title="confirmation time"),
    Measure("containment_s", "first report until it is contained"),
    Measure("closing_s", "first report until it is closed"),
    Measure("bound_s", "least response time that any policy could have"),
    Measure("watched_s", "for how long it was followed"),
)
RESPONDER_COLUMNS = (
    text("name", "of the responder"),
    text("kind", "guard or robot"),
    Measure("use", "share of the time measured with an order"),
    Measure("exposure_s", "time within danger radii"),
    Measure("distance_m", "way travelled"),
    Measure("confirms", "orders to find out"),
    Measure("contains", "orders to contain"),
    Measure("stand_bys", "orders to wait elsewhere"),
)


def measures_of(scenario: TimedScenario) -> tuple[str, ...]:
    """Return the measures that a run of a scenario holds: nothing is contained that need not be."""
    gone = () if scenario.dispatch.containment else _OF_CONTAINMENT
    return names_of(column for column in RUN_COLUMNS if column not in gone)


Columns = dict[str, NDArray[Any]]


def tables(recording: TimedRecording, follow: float = FOLLOW_S) -> dict[str, list[Row]]:
    """Return a run's rows: of the run, of each event of the cohort, of each responder.

    Args:
        recording: The run; it must have kept its events.
        follow: For how long each event is followed, T [s].

    Raises:
        ConfigError: the run is too short to follow anything, or has kept no events.
    """
    events = cohort(recording, follow)
    return {
        "runs": [run_row(recording, events, follow)],
        "events": [_row(events, index) for index in range(len(events["event_id"]))],
        "responders": [_responder_row(recording, unit) for unit in recording.units],
    }


# --- events ------------------------------------------------------------------------------
def cohort(recording: TimedRecording, follow: float = FOLLOW_S) -> Columns:
    """Return the events of the cohort by column; times ending in `_s` are from the first report.

    Raises:
        ConfigError: see `tables`.
    """
    scenario = recording.scenario
    raw = recording.columns
    since = scenario.warm_up_s
    until = scenario.horizon_s - (0.0 if scenario.drain else follow)
    if scenario.keep != "events":
        raise ConfigError(f"keep is {scenario.keep!r}; a study of dispatch needs 'events'")
    if until <= since:
        raise ConfigError(
            f"horizon_s {scenario.horizon_s:g} leaves nothing to follow for {follow:g} s after "
            f"warm_up_s {since:g}; give a longer one, or drain"
        )
    detected = raw["detected"]
    chosen = (detected >= since) & (detected <= until)
    bounds = response_bounds(recording)
    picked = {name: values[chosen] for name, values in raw.items()}
    return _columns(recording, picked, bounds[chosen], follow)


def _columns(recording: TimedRecording, raw: Columns, bounds: Floats, follow: float) -> Columns:
    detected = raw["detected"]
    ended = np.array([*OUTCOMES, "open"])[_open_ones(raw)]
    kinds = np.array([*(unit.kind for unit in recording.units), "none"])
    names = np.array([*recording.responders, ""])
    since = {name: raw[name] - detected for name in ("arrived", "confirmed", "contained", "closed")}
    if recording.scenario.drain:  # watched until all was over
        watched = np.full(len(detected), follow)
    else:
        watched = np.minimum(recording.scenario.horizon_s - detected, follow)
    return {
        "event_id": raw["number"] + 1,
        "stream": np.array(recording.streams)[raw["stream"]],
        "kind": np.array([s.kind for s in recording.scenario.demand])[raw["stream"]],
        "zone": np.array([*recording.zones, ""])[raw["zone"]],
        "is_true": raw["true"].astype(bool),
        "severity": raw["severity"],
        "shared": raw["shared"].astype(bool),
        "responder": names[raw["responder"]],
        "responder_kind": kinds[raw["responder"]],
        "attempts": raw["attempts"],
        "preemptions": raw["preemptions"],
        "outcome": ended,
        "t_detected_s": detected,
        "response_s": np.maximum(since["arrived"], 0.0),
        "confirmation_s": np.maximum(since["confirmed"], 0.0),
        "containment_s": np.maximum(since["contained"], 0.0),
        "closing_s": np.maximum(since["closed"], 0.0),
        "bound_s": bounds,
        "watched_s": watched,
    }


def _open_ones(raw: Columns) -> NDArray[np.intp]:
    """Return the code of each outcome; `open` for events that were not closed."""
    return np.where(np.isfinite(raw["closed"]), raw["outcome"], len(OUTCOMES)).astype(np.intp)


def _row(columns: Columns, index: int) -> Row:
    return {name: values[index].item() for name, values in columns.items()}


# --- their fates in time -------------------------------------------------------------------
def fates(events: Columns) -> Incidence:
    """Return the cumulative incidence of `FATES`, the first that each event met.

    Works on the rows of either model: it needs the columns `outcome`, `confirmation_s`,
    `closing_s` and `watched_s`.
    """
    closed = events["closing_s"]
    outcome = events["outcome"]
    ends = [np.where(outcome == fate, closed, np.nan) for fate in FATES[1:]]
    time, cause = first_of([events["confirmation_s"], *ends], events["watched_s"])
    return incidence(time, cause, len(FATES))


def reaching(events: Columns, column: str) -> Incidence:
    """Return the cumulative incidence of getting there (cause 1) against being over without it (2).

    Args:
        events: Columns; those of `fates`, and `column`.
        column: `response_s`, `confirmation_s` or `containment_s`.
    """
    time, cause = first_of([events[column], events["closing_s"]], events["watched_s"])
    return incidence(time, cause, 2)


def only(events: Columns, mask: NDArray[np.bool_]) -> Columns:
    """Return the columns of some events."""
    return {name: values[mask] for name, values in events.items()}


def zone_ratio(events: Columns, follow: float) -> float:
    """Return the worst zone's restricted mean response over the best's; nan below two zones."""
    means = [
        reaching(only(events, here), "response_s").restricted_mean(follow)
        for zone in sorted(set(events["zone"].tolist()))
        if (here := events["zone"] == zone).sum() >= MIN_IN_ZONE
    ]
    return max(means) / min(means) if len(means) > 1 and min(means) > 0 else math.nan


# --- the run -------------------------------------------------------------------------------
def run_row(recording: TimedRecording, events: Columns, follow: float) -> Row:
    """Return one row of all measures; see the head of this file."""
    row: Row = {"follow_s": follow, "events": len(events["event_id"])}
    row["true_share"] = mean(events["is_true"])
    row |= _times(events, follow) | _fates(events, follow)
    if recording.scenario.dispatch.containment:
        curve = reaching(only(events, events["is_true"]), "containment_s")
        row |= {
            "contained_share": float(curve.at(follow)),
            "containment_mean_s": curve.restricted_mean(follow),
        }
    row |= {"zone_ratio": zone_ratio(events, follow)} | _bound(events, follow)
    row |= _team(recording) | _exposure(recording) | _dispatching(recording)
    return row | {"violations": sum(recording.violations.values()), "simulated_s": recording.ended}


def _times(events: Columns, follow: float) -> Row:
    response = reaching(events, "response_s")
    confirmation = reaching(only(events, events["is_true"]), "confirmation_s")
    row: Row = {
        "on_scene_share": float(response.at(follow)),
        "response_mean_s": response.restricted_mean(follow),
        "confirmation_mean_s": confirmation.restricted_mean(follow),
    }
    for q in PERCENTILES:
        row[f"response_p{q}_s"] = response.quantile(q / 100)
    arrived = np.isfinite(events["response_s"])
    row["robot_share"] = mean(events["responder_kind"][arrived] == "robot")
    return row


def _fates(events: Columns, follow: float) -> Row:
    curve = fates(events)
    shares = {fate: float(curve.at(follow, 1 + i)) for i, fate in enumerate(FATES)}
    row: Row = {f"{fate}_share": share for fate, share in shares.items()}
    row["open_share"] = max(0.0, 1.0 - sum(shares.values()))
    later = (events["outcome"] == "escalated") & (events["confirmation_s"] <= follow)
    row["escalated_later_share"] = mean(later & (events["closing_s"] <= follow))
    true = only(events, events["is_true"])
    row["confirmed_of_true_share"] = float(reaching(true, "confirmation_s").at(follow))
    return row


def _bound(events: Columns, follow: float) -> Row:
    """Return the bound, as a restricted mean too, and how often a response came before it."""
    bounds = events["bound_s"]
    response = events["response_s"]
    return {
        "bound_mean_s": mean(np.minimum(bounds, follow)),
        "beats_bound_share": mean(response < bounds - SLACK),
    }


def _team(recording: TimedRecording) -> Row:
    """Return the load of the team and its evenness; `load` is that of the busiest kind of people.

    Robots do not limit a team that has more of them than operators; people do: guards look and
    contain, operators drive.
    """
    row: Row = {}
    for kind in ("guard", "robot"):
        busy = [unit.busy for unit in recording.units if unit.kind == kind]
        row[f"use_of_{kind}s"] = mean(busy) / recording.duration if busy else math.nan
        row[f"evenness_of_{kind}s"] = evenness(busy)
    operators = recording.operators
    row["use_of_operators"] = mean(operators) / recording.duration if operators else math.nan
    people = (row["use_of_guards"], row["use_of_operators"])
    row["load"] = max((use for use in people if math.isfinite(use)), default=math.nan)
    return row


def _exposure(recording: TimedRecording) -> Row:
    """Return the time of people within danger radii, in all of the measured time.

    `exposure_s` is the sum per event, of which `exposure_look_s` comes from finding out (way,
    look and leaving) and the rest from containing; `exposure_max_s_per_h` is that of the person
    most exposed, per hour.
    """
    events = max(1, int(recording.measured.sum()))
    guards = [unit.exposure for unit in recording.units if unit.kind == "guard"]
    whole = [sum(stages.values()) for stages in guards]
    act = sum(stages["act"] for stages in guards)
    return {
        "exposure_s": sum(whole) / events,
        "exposure_look_s": (sum(whole) - act) / events,
        "exposure_max_s_per_h": max(whole, default=0.0) / recording.duration * 3600.0,
    }


def _dispatching(recording: TimedRecording) -> Row:
    counted = recording.counters
    row: Row = {what: counted[what] for what in ("preempted", "relocated", "auctions", "overruled")}
    return row | {"policy_failed": counted["policy failed"], "messages": recording.messages}


def _responder_row(recording: TimedRecording, unit: UnitRecord) -> Row:
    return {
        "name": unit.name,
        "kind": unit.kind,
        "use": unit.busy / recording.duration,
        "exposure_s": float(sum(unit.exposure.values())),
        "distance_m": unit.distance,
        **{f"{task}s": unit.jobs[task] for task in ("confirm", "contain", "stand_by")},
    }
