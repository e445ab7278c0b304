"""From the trials of a block to the one row of its run."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from dva_sim.tasks.measures import fit_line, throughput
from dva_sim.tasks.scenario import TaskScenario

Row = dict[str, Any]

MEANS = (
    "movement_time_s",
    "completed",
    "error",
    "overshoots",
    "wall_crossings",
    "stops",
    "path_error_rms_m",
    "tracking_error_rms_m",
    "crossover_rad_s",
    "phase_margin_deg",
    "path_m",
    "waits",
    "wait_s",
    "move_and_wait_share",
    "delay_felt_s",
)
"""Columns of the trials whose mean is a column of the run, as far as the task has them."""
_DRIVEN = ("tunnel", "corner", "slalom", "course")
_AIMED = ("pointing", *_DRIVEN)
FARTHEST = ("tilt_max_rad", "deflection_max")
SHARES = {"completed": "completed_share", "error": "error_share"}
MEASURES = (
    *("trials", *(SHARES.get(name, name) for name in MEANS), *FARTHEST),
    *("throughput_bps", "effective_throughput_bps", "id_slope_s_per_bit", "steering_slope_s"),
    *("plugin_failures", "simulated_s"),
)
"""Numbers that a row of `run_row` may hold, and so what a study may ask for."""

_OF_KINDS = {
    "error_share": _AIMED,
    "overshoots": ("pointing", "reach"),
    "wall_crossings": _DRIVEN,
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
    """Those of `MEASURES` that a run of a scenario holds, by its task and device."""
    task, device = scenario.task.kind, scenario.device.kind
    return tuple(
        name
        for name in MEASURES
        if task in _OF_KINDS.get(name, (task,)) and device in _OF_DEVICES.get(name, (device,))
    )


def run_row(trials: Sequence[Mapping[str, Any]]) -> Row:
    """The means over all trials, and what is measured of them together.

    `throughput_bps` is the mean over conditions of the nominal throughput, and
    `effective_throughput_bps` of that with effective width and amplitude, over the trials that
    were done. `id_slope_s_per_bit` is the time that one more bit of the index of difficulty takes
    in pointing, `steering_slope_s` that one more width of a tunnel takes, where there are several.

    Args:
        trials: Rows of `play`.
    """
    row: Row = {"trials": len(trials)}
    for name in MEANS:
        if name in trials[0]:
            row[SHARES.get(name, name)] = mean(trial[name] for trial in trials)
    row["plugin_failures"] = sum(trial["plugin_failures"] for trial in trials)
    for name in FARTHEST:
        if name in trials[0]:
            row[name] = max(float(trial[name]) for trial in trials)
    done = [trial for trial in trials if trial["completed"]]
    if "id_bits" in trials[0]:
        row |= _throughputs(done)
        row["id_slope_s_per_bit"] = _slope(done, "id_bits")
    if "steering_id" in trials[0]:
        row["steering_slope_s"] = _slope(done, "steering_id")
    return row | {"simulated_s": sum(float(trial["trial_time_s"]) for trial in trials)}


def mean(values: Iterable[float]) -> float:
    """The mean of what is finite; nan of nothing."""
    finite = [float(value) for value in values if math.isfinite(value)]
    return sum(finite) / len(finite) if finite else math.nan


def _throughputs(done: Sequence[Mapping[str, Any]]) -> Row:
    cells: dict[tuple[float, float], list[Mapping[str, Any]]] = defaultdict(list)
    for trial in done:
        cells[trial["amplitude_m"], trial["width_m"]].append(trial)
    nominal, effective = [], []
    for (amplitude, width), trials in cells.items():
        times = [trial["movement_time_s"] for trial in trials]
        ends = [trial["end_m"] for trial in trials]
        nominal.append(throughput(amplitude, width, times))
        effective.append(throughput(amplitude, width, times, ends))
    return {"throughput_bps": mean(nominal), "effective_throughput_bps": mean(effective)}


def _slope(done: Sequence[Mapping[str, Any]], key: str) -> float:
    x, y = [t[key] for t in done], [t["movement_time_s"] for t in done]
    return fit_line(x, y).slope if len(set(x)) > 1 else math.nan
