"""What the literature measures of pointing, steering and tracking, and the rows that hold it.

References:
    I. S. MacKenzie: Fitts' law as a research and design tool in human-computer interaction.
    Human-Computer Interaction 7, 1992 (Shannon form, effective width).
    R. W. Soukoreff, I. S. MacKenzie: Towards a standard for pointing device evaluation. Int. J.
    Human-Computer Studies 61, 2004 (throughput).
    J. Accot, S. Zhai: Beyond Fitts' law: models for trajectory-based HCI tasks. CHI 1997.
    D. T. McRuer et al.: Human pilot dynamics in compensatory systems. AFFDL-TR-65-15, 1965.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.measure import Measure, names_of
from dva_sim.simulation.task.scenario import TaskScenario

Floats = NDArray[np.float64]

WIDTH_PER_SD = 4.133  # the middle 96 % of a normal law: what an effective width holds


def fitts_id(amplitude: float, width: float) -> float:
    """Index of difficulty in the Shannon form [bit]."""
    return math.log2(amplitude / width + 1.0)


def steering_id(length: float, width: float) -> float:
    """Index of difficulty of a tunnel of constant width: how many widths it is long."""
    return length / width


def effective_width(ends: Sequence[float]) -> float:
    """The width that 96 % of the end points would fill [m]; ends along the task axis [m]."""
    return WIDTH_PER_SD * float(np.std(ends, ddof=1))


def throughput(
    amplitude: float, width: float, times: Sequence[float], ends: Sequence[float] | None = None
) -> float:
    """Bits per second over the trials of one condition.

    Args:
        amplitude: Nominal way to the target [m].
        width: Nominal width [m]; stands where no `ends` are given.
        times: Movement times [s].
        ends: Where the trials ended along the task axis, from the centre of the target [m]: the
            index then rests on the effective width and the amplitude really covered.

    Returns:
        nan without trials, or if all trials ended at the same place.
    """
    if not len(times):
        return math.nan
    if ends is not None:
        if len(ends) < 2 or not (width := effective_width(ends)):
            return math.nan
        amplitude += float(np.mean(ends))
    return fitts_id(amplitude, width) / float(np.mean(times))


class FittedLine(NamedTuple):
    """A straight line fitted by least squares, and the share of variance that it explains."""

    intercept: float
    slope: float
    r2: float


def fit_line(x: Sequence[float] | Floats, y: Sequence[float] | Floats) -> FittedLine:
    """The least-squares line through points.

    Raises:
        ValueError: fewer than two different x.
    """
    xs, ys = np.asarray(x, float), np.asarray(y, float)
    if len(np.unique(xs)) < 2:
        raise ValueError("a line needs two different x")
    slope, intercept = np.polyfit(xs, ys, 1)
    rest = ys - (intercept + slope * xs)
    total = float(((ys - ys.mean()) ** 2).sum())
    r2 = 1.0 - float((rest**2).sum()) / total if total else 1.0
    return FittedLine(float(intercept), float(slope), r2)


class Crossover(NamedTuple):
    """Where the open loop has a gain of one: frequency [rad/s] and phase margin [rad]."""

    frequency: float
    phase_margin: float


def open_loop(
    target: Floats, cursor: Floats, dt: float, frequencies: Sequence[float]
) -> NDArray[np.complex128]:
    """Cursor over error at the frequencies of the forcing function.

    The record must hold a whole number of periods of each, so that none leaks into another.

    Args:
        target: `(n,)` [m].
        cursor: `(n,)` [m].
        dt: Between samples [s].
        frequencies: `(k,)` [rad/s].

    Returns:
        `(k,)`, the describing function of operator and plant together.
    """
    times = np.arange(len(target)) * dt
    waves = np.exp(-1j * np.outer(frequencies, times))
    error = waves @ (target - cursor)
    return np.asarray(waves @ cursor / error)


def crossover(frequencies: Sequence[float], loop: NDArray[np.complex128]) -> Crossover:
    """Read crossover frequency and phase margin off a measured open loop.

    Between the two frequencies around the crossover the gain is straight in log over log, and the
    phase in log frequency, the shorter way round. Of the phase nothing else counts: the lowest
    sines, of whose periods a record holds few, are the noisiest. Where the gain is below one
    everywhere, or nowhere, there is nan.

    Returns:
        The margin is within (-pi, pi]: whole turns cannot be told.
    """
    log_w, gain = np.log(np.asarray(frequencies)), np.log(np.abs(loop))
    falls = np.flatnonzero((gain[:-1] >= 0.0) & (gain[1:] < 0.0))
    if not len(falls):
        return Crossover(math.nan, math.nan)
    i = int(falls[0])
    share = gain[i] / (gain[i] - gain[i + 1])
    at = log_w[i] + share * (log_w[i + 1] - log_w[i])
    angle = float(np.angle(loop[i]) + share * np.angle(loop[i + 1] / loop[i]))
    return Crossover(float(np.exp(at)), math.pi - (-angle) % (2.0 * math.pi))


Row = dict[str, Any]

_DRIVEN = ("tunnel", "corner", "slalom", "course")
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
"""What is measured of whatever is driven, here and over a congested link."""
_AVERAGED = (
    *DRIVEN_COLUMNS,
    Measure("error", "1 if a selection missed or a wall was crossed, else 0", low=0, high=1),
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
_FAILURES = Measure(
    "plugin_failures", "times that a class of the user's gave no answer that is one"
)
TRIAL_COLUMNS = (
    *_AVERAGED,
    *_FARTHEST,
    _FAILURES,
    Measure("number", "of the trial in its block, from 0"),
    Measure("condition", "of the task, from 0"),
    Measure("amplitude_m", "way to the target"),
    Measure("width_m", "of the target, tunnel or way"),
    Measure("length_m", "of the tunnel or way"),
    Measure("spacing_m", "between the gates of a slalom"),
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
    """The column of the run that a column of its trials becomes."""
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
"""What a row of `run_row` may hold, and so what a study may ask for."""

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
    """The measures that a run of a scenario holds, by its task and device."""
    task, device = scenario.task.kind, scenario.device.kind
    return tuple(
        name
        for name in names_of(RUN_COLUMNS)
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
    for column in _AVERAGED:
        if column.name in trials[0]:
            row[_of_block(column).name] = mean(trial[column.name] for trial in trials)
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
