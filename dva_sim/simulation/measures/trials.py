"""The rows of a block of trials and of its run: which columns they have, and what these hold."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from dva_sim.kernel.measure import Measure, names_of
from dva_sim.simulation.measures.commands import Row
from dva_sim.simulation.task.movement_laws import fit_line, throughput
from dva_sim.simulation.task.scenario import TaskScenario

_DRIVEN = ("tunnel", "corner", "slalom", "course", "heading_step")
_AIMED = ("pointing", *_DRIVEN)
DRIVEN_COLUMNS = (
    Measure(
        "movement_time_s",
        "time that the task took; the horizon if it was given up",
        awaits="completion",
    ),
    Measure("completed", "1 if the task was done, else 0", better="large", low=0, high=1),
    Measure("wall_crossings", "times that the wall was crossed"),
    Measure("path_error_rms_m", "distance from the middle of the way, root mean square"),
    Measure("waits", "waits to see the result of a move"),
    Measure("wait_s", "time spent in these waits"),
    Measure(
        "delay_felt_s",
        "delay as the person takes it, at the end",
        title="delay as the person takes it",
    ),
)
"""Measures of any driven vehicle, here and over a congested link."""
_AVERAGED = (
    *DRIVEN_COLUMNS,
    Measure("error", "1 if a selection missed or a wall was crossed, else 0", low=0, high=1),
    Measure("presses", "presses of the button until the target was hit or the trial over"),
    Measure("miss_m", "distance of the last press, or of the end, from the centre of the target"),
    Measure("reaction_s", "time from the first picture until the person began to steer"),
    Measure("pulse_s", "time in which the first correction grew"),
    Measure("overshoots", "times that the target was left again"),
    Measure("stops", "places reached, of those to go to", better="large"),
    Measure("tracking_error_rms_m", "distance from the moving target, root mean square"),
    Measure("crossover_rad_s", "crossover frequency of person, device and delay", better="large"),
    Measure("phase_margin_deg", "phase margin at the crossover", better="large"),
    Measure("path_m", "way of the cursor or vehicle", title="path length"),
    Measure("move_and_wait_share", "share of the time steered by moving and waiting"),
)
"""Columns of the trials whose mean is a column of the run, as far as the task has them."""
_FARTHEST = (
    Measure("tilt_max_rad", "farthest that the hand tilted the device about an axis"),
    Measure("deflection_max", "farthest that the stick was deflected, 1 for all the way"),
)
_FAILURES = Measure("plugin_failures", "invalid answers of a user's class")
TRIAL_COLUMNS = (
    *_AVERAGED,
    *_FARTHEST,
    _FAILURES,
    Measure("number", "of the trial in its block, from 0"),
    Measure("condition", "of the task, from 0"),
    Measure("since_start", "number of the trial since the block began, practice included"),
    Measure("amplitude_m", "way to the target"),
    Measure("width_m", "of the target, tunnel or way"),
    Measure("length_m", "of the tunnel or way"),
    Measure("spacing_m", "between the gates of a slalom"),
    Measure("heading_error_deg", "of the heading when the picture appears"),
    Measure("excursion_m", "greatest excursion of the target"),
    Measure("bandwidth_rad_s", "highest frequency of the target"),
    Measure("id_bits", "index of difficulty, Shannon form"),
    Measure("steering_id", "length of the tunnel over its width"),
    Measure(
        "end_m",
        "where the trial ended along the task axis, from the target's centre",
        low=-math.inf,
    ),
    Measure("target_rms_m", "excursion of the target, root mean square"),
    Measure("work_s", "work at the places reached, whoever commands it"),
    Measure("trial_time_s", "from the beginning of the trial, also before the movement is timed"),
)
_SHARES = {
    "completed": Measure(
        "completed_share", "share of the trials done", title="share of trials done", better="large"
    ),
    "error": Measure(
        "error_share", "share of the trials with an error", title="share of trials with an error"
    ),
}


def _of_block(column: Measure) -> Measure:
    """Return the column of the run that a column of its trials becomes."""
    mean = replace(column, meaning=f"{column.meaning}; mean over trials")
    return _SHARES.get(column.name, mean)


RUN_COLUMNS = (
    Measure("trials", "in the block"),
    *map(_of_block, _AVERAGED),
    *_FARTHEST,
    Measure("throughput_bps", "nominal throughput, mean over conditions", better="large"),
    Measure(
        "effective_throughput_bps",
        "throughput with effective width and amplitude, likewise",
        title="throughput with effective width",
        better="large",
    ),
    Measure(
        "id_slope_s_per_bit",
        "time for one more bit of the index of difficulty",
        title="time for one more bit of the index of difficulty",
    ),
    Measure(
        "steering_slope_s",
        "time for one more width of a tunnel's length",
        title="time for one more width of a tunnel",
    ),
    _FAILURES,
    Measure("simulated_s", "virtual time simulated"),
)
"""Columns of `run_row`, which a study may ask for."""

_OF_KINDS = {
    "error_share": _AIMED,
    "overshoots": ("pointing", "reach"),
    "wall_crossings": _DRIVEN,
    **dict.fromkeys(("presses", "miss_m"), ("pointing",)),
    **dict.fromkeys(("reaction_s", "pulse_s"), ("heading_step",)),
    "stops": ("reach",),
    "path_error_rms_m": _DRIVEN,
    "steering_slope_s": _DRIVEN,
    **dict.fromkeys(("tracking_error_rms_m", "crossover_rad_s", "phase_margin_deg"), ("tracking",)),
    **dict.fromkeys(
        ("throughput_bps", "effective_throughput_bps", "id_slope_s_per_bit"), ("pointing",)
    ),
}
_OF_DEVICES = {
    "tilt_max_rad": ("tilt_position", "tilt_velocity"),
    "deflection_max": ("joystick",),
}


def measures_of(scenario: TaskScenario) -> tuple[str, ...]:
    """Return the measures that a run of a scenario holds, by its task and device."""
    task = scenario.task.kind
    device = scenario.device.kind
    return tuple(
        name
        for name in names_of(RUN_COLUMNS)
        if task in _OF_KINDS.get(name, (task,)) and device in _OF_DEVICES.get(name, (device,))
    )


def run_row(trials: Sequence[Mapping[str, Any]]) -> Row:
    """Return the means over all trials, and what is measured of them together.

    `throughput_bps` is the mean over conditions of the nominal throughput, and
    `effective_throughput_bps` of that with effective width and amplitude, over the trials that
    were done. `id_slope_s_per_bit` is the time that one more bit of the index of difficulty takes
    in pointing, `steering_slope_s` that one more width of a tunnel takes, where there are several.

    Args:
        trials: Rows of `play`.
    """
    row: Row = {"trials": len(trials)}
    for column in _AVERAGED:
        if column.name in trials[0]:
            row[_of_block(column).name] = finite_mean(trial[column.name] for trial in trials)
    row["plugin_failures"] = sum(trial["plugin_failures"] for trial in trials)
    for name in names_of(_FARTHEST):
        if name in trials[0]:
            row[name] = max(float(trial[name]) for trial in trials)
    done = [trial for trial in trials if trial["completed"]]
    if "id_bits" in trials[0]:
        row |= _throughputs(done)
        row["id_slope_s_per_bit"] = _slope(done, "id_bits")
    if "steering_id" in trials[0]:
        row["steering_slope_s"] = _slope(done, "steering_id")
    return row | {"simulated_s": sum(float(trial["trial_time_s"]) for trial in trials)}


def finite_mean(values: Iterable[float]) -> float:
    """Return nan of nothing."""
    finite = [float(value) for value in values if math.isfinite(value)]
    return sum(finite) / len(finite) if finite else math.nan


def _throughputs(done: Sequence[Mapping[str, Any]]) -> Row:
    cells: dict[tuple[float, float], list[Mapping[str, Any]]] = defaultdict(list)
    for trial in done:
        cells[trial["amplitude_m"], trial["width_m"]].append(trial)
    nominal = []
    effective = []
    for (amplitude, width), trials in cells.items():
        times = [trial["movement_time_s"] for trial in trials]
        ends = [trial["end_m"] for trial in trials]
        nominal.append(throughput(amplitude, width, times))
        effective.append(throughput(amplitude, width, times, ends))
    return {
        "throughput_bps": finite_mean(nominal),
        "effective_throughput_bps": finite_mean(effective),
    }


def _slope(done: Sequence[Mapping[str, Any]], key: str) -> float:
    x = [t[key] for t in done]
    y = [t["movement_time_s"] for t in done]
    return fit_line(x, y).slope if len(set(x)) > 1 else math.nan
