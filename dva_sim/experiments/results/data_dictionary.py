"""The data dictionary: what every column of every table means. Its unit is the end of its name.

Times of events are seconds of the run; what did not happen is missing (nan, or empty in CSV).
Columns `*_share` are from 0 to 1, and columns of counts have no unit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from dva_sim.experiments.study.schema import REPEATS
from dva_sim.kernel.units import unit_of

Meanings = dict[str, str]


class Column(NamedTuple):
    """A line of the dictionary.

    Attributes:
        table: Name of the table.
        name: Of the column.
        unit: As printed; empty for what has none.
        meaning: In words; empty if nothing is known of it.
    """

    table: str
    name: str
    unit: str
    meaning: str


DESIGN: Meanings = {
    "part": "part of the study",
    "cell": "position of the configuration in the design, -1 for a reference run",
    "config": "hash of the scenario as run, but for the person",
    "is_reference": "whether the others are measured against this run",
    "person": "simulated person, or with the timed model independent run; the cluster",
    "trial": "of the person; the same random numbers in every cell",
    "seed": "of the run; the same for this person and trial in every cell",
    "parameters": "set of the persons' parameters in a repeat, 0 for the usual ones",
}

_EVERY_RUN: Meanings = {
    "violations": "safety rules found broken; there should be none",
    "simulated_s": "virtual time simulated",
    "plugin_failures": "times that a class of the user's gave no answer that is one",
}
_STEERING: Meanings = {
    "turns_per_min": "turning from one robot to another, per minute with work in hand",
    "reversals_per_min": "reversals of the turn rate wanted by at least 0.1 rad/s",
    "command_changes_per_min": "commands that are clearly others than the last",
    "steering_entropy": "how unpredictably somebody steers, 0 like clockwork to 1",
    "waiting_share": "share of the steering time in which the robot was asked to stand",
    "move_waits": "waits to see the result of a move",
    "move_and_wait_share": "share of the driving time steered by moving and waiting",
    "missed": "events refuted although they were there",
    "false_confirmations": "events confirmed although nothing was there",
}
_DRIVES: Meanings = {
    "confirmed": "whether the first driven event was confirmed",
    "outcome": "how the last drive to it ended",
    "cause": "why it was not confirmed; empty if it was",
    "drive_time_s": "first order to confirmation, over all attempts; else the whole horizon",
    "attempts": "drives to the event",
    "path_m": "way of the robots that were driven",
    "contacts": "contacts of these robots with walls and others",
    "contact_impulse_n_s": "impulse of all contacts",
    "person_contacts": "contacts with people",
    "jams": "times that a robot was jammed",
    "command_rate_hz": "commands applied per second of driving",
    "commands_sent": "commands that the phone sent",
    "commands_applied": "commands that took effect",
    "commands_stale": "commands that a robot refused as too old",
    "commands_superseded": "commands that a newer one replaced before they took effect",
    "round_trip_p50_s": "median time from a command's request to its answer",
    "round_trip_p95_s": "percentile 95 of this time",
    "round_trip_max_s": "longest such time",
    "samples_per_value": "accelerometer samples in a batch of the phone's filter, mean",
    "queue_max": "most commands that waited at a robot",
    "timeouts": "requests whose answer did not come in time",
    "alerts": "alerts of the phone that the link may be lost",
    "stop_share": "share of the driving time without a command in force",
}
_DELAYS: Meanings = {
    "command_age_mean_s": "mean age of commands at application, from making to effect",
    **{f"command_age_p{q:02}_s": f"percentile {q} of this age" for q in (5, 25, 50, 75, 95)},
    "age_in_force_mean_s": "age of the command in force, mean over time",
    "delay_frame_s": "time that a picture has been acted on, until the next one comes",
    "delay_downlink_s": "sending of a picture until the operator sees it",
    "delay_human_s": "seeing until wanting",
    "delay_hand_s": "lag of the hand",
    "delay_filter_s": "age that the phone's filter adds",
    "delay_sampling_s": "time since the command in force took effect",
    "delay_pattern_s": "making of a command until it may be sent",
    "delay_uplink_s": "sending of a command until it arrives",
    "delay_processing_s": "arrival at the robot until the command takes effect",
    "delay_motor_s": "time constant of the motors",
    "frame_age_mean_s": "age of the picture that the person reacts to: frame and downlink",
    "loop_delay_mean_s": "observation to effect, as the sum of the stages `delay_*_s`",
    "loop_delay_measured_s": "the same, measured as a whole",
}
_PEOPLE_OF_A_RUN: Meanings = {
    "person_exposure_s": "time of people within danger radii, summed over people",
    "dose_heat_max": "largest fractional effective dose of heat; 1 incapacitates",
    "dose_toxic_max": "largest fractional effective dose of toxic gas; 1 incapacitates",
    "incapacitated": "people who could not help themselves any more",
    "evacuated_share": "share of the bystanders who got out",
    "evacuated_s": "when the last of those who got out was out",
}
_FULL_RUN: Meanings = {
    **_DRIVES,
    **_DELAYS,
    **_PEOPLE_OF_A_RUN,
    **_STEERING,
    "events": "events that the DVA knew of",
    "response_mean_s": "first report to somebody on scene, mean; the horizon where never",
    "confirmation_mean_s": "first report to confirmation of true ones, mean; the horizon if never",
    "settled_per_min": "events confirmed, contained or refuted per minute of the run",
    "utilisation": "share of the run with an order in hand, mean over operators",
    "attending_share": "share of the run with eyes on a picture, mean over operators",
    "queue_mean": "robots that waited for their operator, mean over time and operators",
    "path_error_rms_m": "distance from the ways planned, root mean square",
    "path_error_max_m": "greatest distance from the ways planned",
    "replans": "ways that were planned anew",
    "messages": "messages on the network",
    "traffic_bytes": "size of all messages on the network",
    "refused": "requests that were refused",
    "network_depth": "how closely the network was modelled: message, segment or datagram",
}
_STEPS = ("detected", "assigned", "departed", "arrived", "confirmed", "contained", "closed")
_FULL_EVENT: Meanings = {
    "event_id": "number of the event in its run, from 1",
    "kind": "of the event",
    "room": "where it was",
    "is_true": "whether it is no false alarm",
    "responder_kind": "who was sent last: robot, guard or none",
    "responder": "its name",
    "outcome": "confirmed, contained, refuted, escalated, expired, open or undetected",
    "t_occurred_s": "when it began",
    **{f"t_{step}_s": f"when it was {step}" for step in _STEPS},
    "t_departed_s": "when the responder set out",
    "t_arrived_s": "when the responder was on scene",
    "response_s": "detection until somebody is on scene",
    "confirmation_s": "detection until it is confirmed",
    "containment_s": "detection until it is contained",
    "closing_s": "detection until it is closed",
    "watched_s": "detection until nobody looks any more: the end of the run",
    "missed": "whether it was refuted although it was there",
    "false_confirmation": "whether it was confirmed although nothing was there",
}
_PERSON: Meanings = {
    "person_name": "guard or bystander",
    "kind": "guard or bystander",
    "activity": "at the end of the run",
    "exposure_s": "time within danger radii",
    "dose_heat": "fractional effective dose of heat; 1 incapacitates",
    "dose_toxic": "fractional effective dose of toxic gas; 1 incapacitates",
    "t_leaves_s": "when it set out to leave",
    "t_out_s": "when it was out",
}
_OPERATOR: Meanings = {
    **_STEERING,
    "operator_name": "who",
    "orders": "orders received",
    "utilisation": "share of the run with an order in hand",
    "attending_share": "share of the run with eyes on a picture",
    "robots_mean": "robots in hand, mean over time",
    "robots_max": "most robots in hand at once",
    "queue_mean": "robots that waited for it, mean over time",
    "queue_max": "most robots that waited at once",
    "turns": "times that it turned from one robot to another",
    "gave_up": "drives that it gave up",
    "lost_links": "drives that ended by a lost link",
}
_TRACK: Meanings = {
    "agent": "robot",
    "t_s": "time of the run",
    "x_m": "place, to the east",
    "y_m": "place, to the north",
    "heading_rad": "anticlockwise from east",
    "mode": "of the robot",
}

_FATES = ("confirmed", "refuted", "escalated", "expired")
_TIMED_RUN: Meanings = {
    "follow_s": "time that every event is followed, T; shares and restricted means end there",
    "events": "events followed",
    "true_share": "share of the events that are no false alarms",
    "on_scene_share": "share of the events with somebody on scene by T",
    "response_mean_s": "mean of min(time to somebody on scene, T)",
    "confirmation_mean_s": "mean of min(time to confirmation, T) of true events",
    "containment_mean_s": "mean of min(time to containment, T) of true events",
    **{f"response_p{q}_s": f"percentile {q} of the time to response" for q in (50, 90, 95)},
    "robot_share": "share of the events with a response where it was a robot's",
    **{
        f"{fate}_share": f"share of the events {fate} by T, before anything else" for fate in _FATES
    },
    "open_share": "share of the events still open at T",
    "escalated_later_share": "share of the events escalated after confirmation, by T",
    "confirmed_of_true_share": "share of the true events confirmed by T",
    "contained_share": "share of the true events contained by T",
    "zone_ratio": "mean response of the worst zone over that of the best",
    "bound_mean_s": "mean of min(least response time that any policy could have, T)",
    "beats_bound_share": "share of the events answered sooner than this bound",
    "use_of_guards": "share of the time measured that guards had an order",
    "use_of_robots": "share of the time measured that robots had an order",
    "use_of_operators": "share of the time measured that operators had an order",
    "evenness_of_guards": "Jain's index of the guards' work, 1 if all have the same",
    "evenness_of_robots": "Jain's index of the robots' work, 1 if all have the same",
    "load": "use of the busier of guards and operators",
    "exposure_s": "time of people within danger radii, per event",
    "exposure_look_s": "the part of it spent on finding out, per event",
    "exposure_max_s_per_h": "exposure of the person most exposed, per hour",
    "preempted": "orders taken back for a more urgent event",
    "relocated": "guards sent to wait elsewhere",
    "auctions": "tasks put up for bids",
    "overruled": "decisions of the policy that the core did not follow",
    "policy_failed": "times that the policy gave no decision, and the default one decided",
    "messages": "messages that the DVA took",
}
_TIMED_EVENT: Meanings = {
    name: _FULL_EVENT[name]
    for name in ("event_id", "kind", "responder_kind", "responder", "t_detected_s")
} | {
    "stream": "stream of the demand that it belongs to",
    "zone": "where it was",
    "is_true": "whether it is no false alarm",
    "severity": "as reported, from 0 to 1",
    "shared": "whether it was merged with an earlier one",
    "attempts": "responders sent",
    "preemptions": "times that its responder was taken away",
    "outcome": "confirmed, contained, refuted, escalated, expired or open",
    "response_s": "first report until somebody is on scene",
    "confirmation_s": "first report until it is confirmed",
    "containment_s": "first report until it is contained",
    "closing_s": "first report until it is closed",
    "bound_s": "least response time that any policy could have",
    "watched_s": "for how long it was followed",
}
_RESPONDER: Meanings = {
    "name": "of the responder",
    "kind": "guard or robot",
    "use": "share of the time measured with an order",
    "exposure_s": "time within danger radii",
    "distance_m": "way travelled",
    "confirms": "orders to find out",
    "contains": "orders to contain",
    "stand_bys": "orders to wait elsewhere",
}

_DRIVEN: Meanings = {
    "movement_time_s": "time that the task took; the horizon if it was given up",
    "completed": "1 if the task was done, else 0",
    "wall_crossings": "times that the wall was crossed",
    "path_error_rms_m": "distance from the middle of the way, root mean square",
    "waits": "waits to see the result of a move",
    "wait_s": "time spent in these waits",
    "delay_felt_s": "delay as the person takes it, at the end",
}
_BLOCK: Meanings = {
    "error": "1 if a selection missed or a wall was crossed, else 0",
    "overshoots": "times that the target was left again",
    "stops": "places reached, of those to go to",
    "tracking_error_rms_m": "distance from the moving target, root mean square",
    "crossover_rad_s": "crossover frequency of person, device and delay",
    "phase_margin_deg": "phase margin at the crossover",
    "path_m": "way of the cursor or vehicle",
    "move_and_wait_share": "share of the time steered by moving and waiting",
    "tilt_max_rad": "farthest that the hand tilted the device about an axis",
    "deflection_max": "farthest that the stick was deflected, 1 for all the way",
    "plugin_failures": _EVERY_RUN["plugin_failures"],
}
_TRIAL: Meanings = {
    **_DRIVEN,
    **_BLOCK,
    "number": "of the trial in its block, from 0",
    "condition": "of the task, from 0",
    "amplitude_m": "way to the target",
    "width_m": "of the target, tunnel or way",
    "length_m": "of the tunnel or way",
    "spacing_m": "between the gates of a slalom",
    "excursion_m": "greatest excursion of the target",
    "bandwidth_rad_s": "highest frequency of the target",
    "id_bits": "index of difficulty, Shannon form",
    "steering_id": "length of the tunnel over its width",
    "end_m": "where the trial ended along the task axis, from the target's centre",
    "target_rms_m": "excursion of the target, root mean square",
    "work_s": "work at the places reached, whoever commands it",
    "trial_time_s": "from the beginning of the trial, also before the movement is timed",
}
_TASK_RUN: Meanings = {
    **{name: f"{meaning}; mean over trials" for name, meaning in (_DRIVEN | _BLOCK).items()},
    "trials": "in the block",
    "completed_share": "share of the trials done",
    "error_share": "share of the trials with an error",
    "tilt_max_rad": _BLOCK["tilt_max_rad"],
    "deflection_max": _BLOCK["deflection_max"],
    "throughput_bps": "nominal throughput, mean over conditions",
    "effective_throughput_bps": "throughput with effective width and amplitude, likewise",
    "id_slope_s_per_bit": "time for one more bit of the index of difficulty",
    "steering_slope_s": "time for one more width of a tunnel's length",
}
for _trial_only in ("completed", "error"):
    del _TASK_RUN[_trial_only]

_WAYS = {"up": "towards the robot", "down": "from the robot"}
_TRANSPORT_RUN: Meanings = {
    **_DRIVEN,
    "commands": "commands made in the time measured",
    "delivered_share": "share of the commands that arrived whole",
    "crucial_delivered_share": "share of the crucial commands that arrived whole",
    "crucial_age_p95_s": "percentile 95 of the age of crucial commands at arrival",
    "command_rate_hz": "commands applied per second",
    "command_age_mean_s": "mean age of applied commands at arrival",
    "command_age_p50_s": "median of this age",
    "command_age_p95_s": "percentile 95 of this age",
    "age_in_force_mean_s": "age of the newest applied command, mean over time",
    "picture_delivered_share": "share of the pictures that arrived whole",
    "picture_rate_hz": "pictures shown per second",
    "picture_age_mean_s": "mean age of pictures at arrival",
    "picture_age_p95_s": "percentile 95 of this age",
    "round_trip_mean_s": "command until the first picture taken after it was applied, mean",
    "round_trip_p95_s": "percentile 95 of this time",
    **{f"session_{way}_bps": f"rate of the session {where}" for way, where in _WAYS.items()},
    **{f"bulk_{way}_bps": f"mean rate of a TCP flow {where}" for way, where in _WAYS.items()},
    **{f"bulk_use_{way}": f"share of the line that TCP flows get {w}" for way, w in _WAYS.items()},
    **{f"jain_{way}": f"Jain's index of all rates {where}" for way, where in _WAYS.items()},
    **{f"share_of_fair_{way}": f"session's rate over a fair one, {w}" for way, w in _WAYS.items()},
}
_FLOW: Meanings = {
    "way": "up is towards the robot",
    "flow": "session, or a TCP flow beside it",
    "rate_bps": "rate on the line, with headers and what is sent again",
}

DICTIONARY: dict[str, dict[str, Meanings]] = {
    "full": {
        "runs": _FULL_RUN | _EVERY_RUN,
        "events": _FULL_EVENT,
        "people": _PERSON,
        "operators": _OPERATOR,
        "tracks": _TRACK,
    },
    "timed": {
        "runs": _TIMED_RUN | {name: _EVERY_RUN[name] for name in ("violations", "simulated_s")},
        "events": _TIMED_EVENT,
        "responders": _RESPONDER,
    },
    "task": {
        "runs": _TASK_RUN | {name: _EVERY_RUN[name] for name in ("plugin_failures", "simulated_s")},
        "trials": _TRIAL,
    },
    "transports": {
        "runs": _TRANSPORT_RUN
        | {name: _EVERY_RUN[name] for name in ("plugin_failures", "simulated_s")},
        "flows": _FLOW,
    },
}
"""The meanings, by model, table and column; the columns of the design are in `DESIGN`."""


def describe(
    table: str, columns: Sequence[str], models: Sequence[str], factors: Sequence[str]
) -> list[Column]:
    """Describe some columns of a table of results.

    Args:
        table: Its name.
        columns: Their names.
        models: Those of the study's parts; where meanings differ, all are given.
        factors: Names of the study's factors.
    """
    return [Column(table, n, unit_of(n), _meaning(table, n, models, factors)) for n in columns]


def _meaning(table: str, name: str, models: Sequence[str], factors: Sequence[str]) -> str:
    if name in factors:
        return f"factor of the study: the scenario key {name}"
    if name in DESIGN:
        return DESIGN[name]
    found = {model: _of_model(model, table).get(name, "") for model in models}
    known = {model: meaning for model, meaning in found.items() if meaning}
    if len(set(known.values())) <= 1:
        return next(iter(known.values()), "")
    return "; ".join(f"{model}: {meaning}" for model, meaning in known.items())


def _of_model(model: str, table: str) -> Mapping[str, str]:
    tables = DICTIONARY.get(model, {})
    return tables.get("runs" if table == REPEATS else table, {})
