"""Published experiments: which task is played under which conditions, and how it is aggregated.

Each aggregates as the publication did: means over all persons, lines through the means of
conditions. The aggregation was fixed before any comparison. At the end of the module the
experiments and the exact checks are played in several processes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, cast

import numpy as np

from dva_sim.agents.population import Person, draw_person
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.kernel import resources
from dva_sim.kernel.streams import Streams, derive_seed
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.models import Tables
from dva_sim.simulation.scenario.parts import OperatorConfig
from dva_sim.simulation.scenario.scenario import population
from dva_sim.simulation.task import TaskScenario, build, play
from dva_sim.simulation.task.movement_laws import fit_line
from dva_sim.validation.frame import Progress, make_job, play_jobs
from dva_sim.validation.operators.exact import MODEL_CHECKS
from dva_sim.validation.operators.looking import PARTS
from dva_sim.validation.operators.trials import (
    Cells,
    Floats,
    LineValue,
    Trials,
    Values,
    certain,
    collect,
    mean,
    person_means,
    person_means_of,
    person_medians,
    with_intervals,
)

FOLDER = "experiments/scenarios/tasks"

LAGS_S = {"8.3": 0.0, "25": 1 / 60, "75": 4 / 60, "225": 13 / 60}  # by the lag's name [ms]
MIN_LAG = "8.3"  # half a frame
PUBLISHED_LAGS = ("8.3", "25", "75")
AT_BITS = 4.0
GAINS = {25: 0.2435, 50: 0.487, 100: 0.974, 200: 1.948}  # pixels/s per degree: [m/s per rad]
PUBLISHED_GAIN = 50
SELECTIONS = {"first-entry": "first_entry", "dwell": "dwell"}
LATENCY_S = 0.05  # latency of the machine in the steering experiment [s]; assumed
STEP_S = 1.0 / 60.0
MIN_WAITS = 0.5  # mean waits per trial from which a person counts as moving and waiting
WAITS_S = (1.0, 1.5, 2.0, 2.5, 3.2)
EXCAVATOR_S = 1.5
FRAME_RATES = (5, 10, 20, 60)
FRAME_DELAYS_S = (0.0, 0.1, 0.2, 0.3)
_NOTHING = 1e-9  # times that differ by less are the same [s]
_C = np.linspace(0.0, 6.0, 121)  # tried for the collapse
TRIED = {"S15/c": (float(_C[0]), float(_C[-1]))}  # range in which a value was searched


@dataclass(frozen=True)
class Experiment:
    """A published experiment.

    Attributes:
        name: Name of the experiment.
        scenario: The task, by name; None: a part of the operator, see `looking`.
        cells: Changes in each cell that the task itself does not cross.
        measure: Function from the trials to the value of each line.
        quick: Further changes for a quick look.
    """

    name: str
    scenario: str | None
    cells: Mapping[str, Mapping[str, Any]]
    measure: Callable[[Cells], Values]
    quick: Mapping[str, Any] = field(default_factory=dict)


# --- pointing under lag: MacKenzie & Ware 1993 -----------------------------------------------
def lag_values(cells: Cells) -> Values:
    """Return ratios of movement times, cost of a millisecond of lag at 4 bits, and times [ms]."""
    times = {lag: mean(trials, "movement_time_s") for lag, trials in cells.items()}
    ratio = {lag: time / times[MIN_LAG] for lag, time in times.items()}
    values = {"S7/25": ratio["25"], "S7/75": ratio["75"], "S8/slope": lag_slope(cells)}
    return values | {f"S7/time-{lag}": 1000.0 * times[lag] for lag in PUBLISHED_LAGS}


def lag_slope(cells: Cells) -> float:
    """Return the publication's model, MT = a + (b + c LAG) ID, through the means; 4 c [ms/ms]."""
    rows = [
        (1.0, bits, bits * float(lag), 1000.0 * float(some["movement_time_s"].mean()))
        for lag, trials in cells.items()
        for (bits,), some in trials.by("id_bits")
    ]
    *design, times = np.array(rows).T
    return float(AT_BITS * np.linalg.lstsq(np.column_stack(design), times, rcond=None)[0][2])


# --- pointing by tilt: MacKenzie & Teather 2012 ----------------------------------------------
def tilt_cell(gain: int, selection: str) -> str:
    """Return the name of a cell."""
    return f"{gain}/{selection}"


def tilt_values(cells: Cells) -> Values:
    """Return the throughput at a gain of 50, the best gain, and the range of the largest tilts."""
    values = {f"S9/{s}": throughput(cells[tilt_cell(PUBLISHED_GAIN, s)]) for s in SELECTIONS}
    times = [
        np.mean([mean(cells[tilt_cell(g, s)], "movement_time_s") for s in SELECTIONS])
        for g in GAINS
    ]
    tilts = [np.degrees(mean(trials, "tilt_max_rad")) for trials in cells.values()]
    values["S10/best"] = float(list(GAINS)[int(np.argmin(times))])
    return values | {"S10/least-tilt": float(min(tilts)), "S10/most-tilt": float(max(tilts))}


def throughput(trials: Trials) -> float:
    """Return the throughput [bit/s]: the mean over all persons and conditions.

    Selections cannot miss here, so the index is the nominal one.
    """
    rates = []
    for (bits,), some in trials.by("id_bits"):
        rates.append(bits / person_means(some, "movement_time_s"))
    return float(np.mean(np.concatenate(rates)))


# --- steering: Wang et al. 2021; latency of steering -----------------------------------------
def steering_values(cells: Cells) -> Values:
    """Return the linearity in ID of the movement time's mean, and in its square of the variance."""
    ids, means, variances = steering_points(cells["tunnel"])
    return {
        "S11/mean": fit_line(ids, means).r2,
        "S11/variance": fit_line(ids**2, variances).r2,
    }


def steering_points(trials: Trials) -> tuple[Floats, Floats, Floats]:
    """Index of difficulty, mean [s] and variance [s^2], over all trials."""
    rows = [
        (key, some["movement_time_s"].mean(), some["movement_time_s"].var(ddof=1))
        for (key,), some in trials.by("steering_id")
    ]
    ids, means, variances = np.array(rows).T
    return ids, means, variances


def latency_values(cells: Cells) -> Values:
    """Return ratios of mean movement times of steering."""
    times = {name: mean(trials, "movement_time_s") for name, trials in cells.items()}
    return {f"S12/{name}": times[name] / times["as it is"] for name in ("less", "more")}


# --- waiting for feedback: Ferrell 1965, an excavator ----------------------------------------
def wait_values(cells: Cells) -> Values:
    """Return the linearity of completion time in the delay, and the slope without the waits.

    The slope of persons who do not wait says nothing about move-and-wait.
    """
    delays = [float(name) for name in cells]
    times = [mean(trials, "movement_time_s") for trials in cells.values()]
    line = fit_line(delays, times)
    waits = float(np.mean([mean(trials, "waits") for trials in cells.values()]))
    straight = line.r2 if np.ptp(times) >= _NOTHING else math.nan  # nothing there to explain
    beyond = line.slope - waits if waits >= MIN_WAITS else math.nan
    return {"S13/linear": straight, "S13/slope": beyond}


def excavator_values(cells: Cells) -> Values:
    """Return the relative increase of the time by the delay."""
    late, prompt = (mean(cells[name], "movement_time_s") for name in (str(EXCAVATOR_S), "0"))
    return {"S17/increase": late / prompt - 1.0}


# --- shown only: tracking and frame rate -----------------------------------------------------
def tracking_values(cells: Cells) -> Values:
    """Return means over persons of the parameters of their open loops."""
    trials = cells["tracking"]
    crossover = mean(trials, "crossover_rad_s")
    margin = mean(trials, "phase_margin_deg")
    return {"S14/crossover": crossover, "S14/margin": margin}


def frame_cell(rate: int, delay: float) -> str:
    """Return the name of a cell."""
    return f"{rate}/{delay:g}"


def frame_points(cells: Cells) -> tuple[Floats, Floats, Floats]:
    """Delay [s], time between frames [s] and mean movement time [s] of each cell."""
    keys = [name.split("/") for name in cells]
    delays = np.array([float(delay) for _, delay in keys])
    gaps = np.array([1.0 / float(rate) for rate, _ in keys])
    return delays, gaps, np.array([mean(t, "movement_time_s") for t in cells.values()])


def frame_values(cells: Cells) -> Values:
    """Return the share of the frame interval that acts as delay, on one parabola of times."""
    delays, gaps, times = frame_points(cells)
    fits = [_parabola(delays + c * gaps, times) for c in _C]
    best = int(np.argmax(fits))  # the first of all if none is a number
    return {"S15/c": float(_C[best]), "S15/collapse": fits[best]}


def _parabola(x: Floats, y: Floats) -> float:
    """Return R2 of the least-squares parabola; nan where nothing varies that could be explained."""
    if np.ptp(y) < _NOTHING:
        return math.nan
    rest = y - np.polyval(np.polyfit(x, y, 2), x)
    return 1.0 - float(rest.var() / y.var())


# --- moving targets under late clicks: Claypool, Eg & Raaen 2017 -------------------------------
ADDED_S = (0.0, 0.1, 0.2, 0.3, 0.4)  # delays on top of the local lag [s]
LOCAL_S = 0.1
SPEEDS_MPS = (0.0375, 0.075, 0.1125)


def moving_cell(added: float, speed: float) -> str:
    """Return the name of a cell."""
    return f"{added:g}/{speed:g}"


def log_times(trials: Trials) -> Floats:
    """Return the logarithm of the duration of each trial `(n,)`."""
    return np.log(trials["movement_time_s"])


def moving_ratios(cells: Cells, added: float, speeds: Sequence[float] = SPEEDS_MPS) -> Floats:
    """Ratio of the times with and without lag, geometric mean over speeds `(persons,)`."""
    logs = [
        person_means_of(cells[moving_cell(added, v)], log_times)
        - person_means_of(cells[moving_cell(0.0, v)], log_times)
        for v in speeds
    ]
    return np.asarray(np.exp(np.mean(logs, axis=0)))


def moving_values(cells: Cells) -> Values:
    """Return the cost of lag, its convexity, differences and learning of persons, and misses."""
    logs = {added: np.log(moving_ratios(cells, added)) for added in ADDED_S}
    ratio = {added: float(np.exp(log.mean())) for added, log in logs.items()}
    slow = [cells[moving_cell(a, SPEEDS_MPS[0])] for a in (0.2, 0.0)]
    late, prompt = (person_means(trials, "movement_time_s") for trials in slow)
    presses = {
        a: np.mean([mean(cells[moving_cell(a, v)], "presses") for v in SPEEDS_MPS])
        for a in (0.0, 0.4)
    }
    return {
        "A1/ratio": ratio[0.1],
        "A2/ratio": ratio[0.2],
        "A3/ratio": ratio[0.4],
        "A4/slope": float(np.mean(late - prompt)) / 0.2,
        "A5/convexity": math.log(ratio[0.4]) / math.log(ratio[0.2]),
        **_individuals(cells),
        "A10/presses": float(presses[0.4] / presses[0.0]),
    }


def _individuals(cells: Cells) -> Values:
    """Return variances within and between persons of log times, slopes on lag, and practice."""
    rest = []
    slopes = []
    errors = []
    practice = []
    every = {cell: log_times(trials) for cell, trials in cells.items()}
    persons = np.unique(next(iter(cells.values())).person)
    within = []
    for person in persons:
        own = {cell: logs[cells[cell].person == person] for cell, logs in every.items()}
        within += [logs - logs.mean() for logs in own.values()]
        rest.append(np.concatenate([logs - every[cell].mean() for cell, logs in own.items()]))
        x = np.concatenate([np.full(len(own[c]), float(c.split("/")[0])) for c in own])
        y = np.concatenate(
            [own[c] - every[moving_cell(0.0, float(c.split("/")[1]))].mean() for c in own]
        )
        slope, cut = np.polyfit(x, y, 1)
        slopes.append(slope)
        left = float(np.var(y - cut - slope * x, ddof=2))
        errors.append(left / float(((x - x.mean()) ** 2).sum()))
        numbers = np.log(
            np.concatenate([cells[c]["since_start"][cells[c].person == person] for c in own])
        )
        practice.append(np.polyfit(numbers, rest[-1] - rest[-1].mean(), 1)[0])
    freedom = sum(len(w) - 1 for w in within)
    inside = float((np.concatenate(within) ** 2).sum()) / freedom
    between = float(np.var([r.mean() for r in rest], ddof=1)) - inside / len(rest[0])
    spread = max(float(np.var(slopes, ddof=1)) - float(np.mean(errors)), 0.0)
    return {
        "A6/between": math.sqrt(max(between, 0.0)),
        "A7/within": math.sqrt(math.expm1(inside)),
        "A8/slopes": math.sqrt(spread) / float(np.mean(slopes)),
        "A9/practice": float(np.mean(practice)),
    }


# --- targets that stand, under late clicks: an open test bed -----------------------------------
LATER_S = (0.0, 0.075, 0.15, 0.225)


def standing_values(cells: Cells) -> Values:
    """Return the cost of lag and the time without, geometric means over conditions."""
    logs = {
        name: np.mean(
            [person_means_of(some, log_times) for _, some in trials.by("amplitude_m", "width_m")],
            axis=0,
        )
        for name, trials in cells.items()
    }
    prompt, *late = (str(added) for added in LATER_S)
    ratios = [float(np.exp(np.mean(logs[name] - logs[prompt]))) for name in late]
    rates = {name: throughput(cells[name]) for name in (prompt, late[-1])}
    return {
        **{f"H{n}/ratio": ratio for n, ratio in enumerate(ratios, 1)},
        "H4/throughput": rates[late[-1]] / rates[prompt],
        "H5/time": mean(cells[prompt], "movement_time_s"),
    }


# --- driving under seconds of delay: lunar rovers ----------------------------------------------
ROUND_TRIPS_S = (0, 4, 6, 8)


def rover_values(cells: Cells) -> Values:
    """Return mean speeds relative to that without delay, over the same course."""
    times = {name: mean(trials, "movement_time_s") for name, trials in cells.items()}
    return {f"L1/{trip}": times["0"] / times[str(trip)] for trip in ROUND_TRIPS_S[1:]}


# --- tilt as a place or as a velocity: Teather & MacKenzie 2014 --------------------------------
TILT_KINDS: dict[str, dict[str, Any]] = {
    "position": {},
    "velocity": {"device.kind": "tilt_velocity", "device.gain": GAINS[PUBLISHED_GAIN]},
}


def tilt_kind_values(cells: Cells) -> Values:
    """Return the throughput of position control by tilt over that of velocity control."""
    rate = {
        kind: np.mean([throughput(cells[f"{kind}/{name}"]) for name in SELECTIONS])
        for kind in TILT_KINDS
    }
    return {"T1/ratio": float(rate["position"] / rate["velocity"])}


# --- one click that may miss: Claypool, Cockburn & Gutwin 2020 ---------------------------------
CLICK_S = {"0": 0.05, "0.25": 0.3}


def click_values(cells: Cells) -> Values:
    """Return the error of a single click under lag, and the cost in time."""
    off = {c: person_medians(trials, "miss_m") for c, trials in cells.items()}
    times = {c: person_medians(trials, "movement_time_s") for c, trials in cells.items()}
    return {
        "A11/off": float(np.exp(np.mean(np.log(off["0.25"] / off["0"])))),
        "A12/slope": float(np.mean(times["0.25"] - times["0"])) / 0.25,
    }


# --- resisting a push: Yamagami et al. 2019 ----------------------------------------------------
def pushed_values(cells: Cells) -> Values:
    """Return parameters of the open loops, and differences between persons."""
    trials = cells["pushed"]
    frequency = person_means(trials, "crossover_rad_s")
    margins = person_means(trials, "phase_margin_deg")
    if not len(frequency):
        return dict.fromkeys(("B1/crossover", "B2/margin", "B3/delay", "B4/spread"), math.nan)
    late = (0.5 * math.pi - np.radians(margins)) / frequency
    spread = frequency.std(ddof=1) / frequency.mean() if len(frequency) > 1 else math.nan
    return {
        "B1/crossover": float(frequency.mean()),
        "B2/margin": float(margins.mean()),
        "B3/delay": float(late.mean()),
        "B4/spread": float(spread),
    }


# --- the first steering: Goodridge et al. 2022 -------------------------------------------------
MIN_REACTION_S = 1e-3  # lower limit of reaction times, for the logarithm


def log_reactions(trials: Trials) -> Floats:
    """Return the natural logarithms of reaction times [log s], shape `(trials,)`."""
    return np.log(np.maximum(trials["reaction_s"], MIN_REACTION_S))


def heading_values(cells: Cells) -> Values:
    """Return the reaction times by error, their spread, and how long the first correction grows."""
    errors = {int(error): own for (error,), own in cells["heading"].by("heading_error_deg")}
    medians = {
        e: np.maximum(person_medians(t, "reaction_s"), MIN_REACTION_S) for e, t in errors.items()
    }
    pulses = np.concatenate([own["pulse_s"] for own in errors.values()])
    means = np.array([person_means_of(own, log_reactions) for own in errors.values()])
    left = np.concatenate(
        [
            log_reactions(own) - person_means_of(own, log_reactions)[own.person]
            for own in errors.values()
        ]
    )
    cellwise = means.size
    return {
        "C1/reaction": float(np.mean(list(medians.values()))),
        "C2/ratio": float(np.mean(medians[1] / medians[2])),
        "C3/pulse": float(np.median(pulses)),
        "C4/within": math.sqrt(float((left**2).sum()) / (len(left) - cellwise)),
        "C4/between": float(means.mean(axis=0).std(ddof=1)),
    }


# --- looking: Wagenmakers et al. 2008, Colley et al. 2025, searchers, walkers ------------------
def choice_values(cells: Cells) -> Values:
    """Return the trade-off of accuracy and speed: times per person, and errors of all."""
    times = {c: person_medians(trials, "time_s") for c, trials in cells.items()}
    errors = {c: mean(trials, "error") for c, trials in cells.items()}
    share = errors["accuracy"] / errors["speed"] if errors["speed"] else math.nan
    return {"D1/time": float(np.mean(times["accuracy"] / times["speed"])), "D2/errors": share}


def vehicle_values(cells: Cells) -> Values:
    """Return the cost of a second vehicle for the first, by persons."""
    logs = [person_means_of(cells[n], lambda t: np.log(t["finish_s"])) for n in ("2", "1")]
    return {"E1/ratio": float(np.exp(np.mean(logs[0] - logs[1])))}


def look_values(cells: Cells) -> Values:
    """Return the quartiles of the durations of all looks, and the spread of their logarithm."""
    looks = cells["two"]["look_s"]
    looks = looks[looks > MIN_LOOK_S]
    first, median, third = np.quantile(looks, [0.25, 0.5, 0.75])
    spread = float(np.log(looks).std(ddof=1))
    return {"E2/median": median, "E2/first": first, "E2/third": third, "E3/spread": spread}


MIN_LOOK_S = 0.3  # shorter looks were not counted [s]


def alarm_values(cells: Cells) -> Values:
    """Return the mean of the medians of persons."""
    return {"E4/opened": float(person_medians(cells["one"], "opened_s").mean())}


def item_values(cells: Cells) -> Values:
    """Share found, mean over persons."""
    return {"F1/found": mean(cells["open"], "found")}


def walker_values(cells: Cells) -> Values:
    """Return statistics of all walkers."""
    speeds = cells["street"]["speed_mps"]
    return {"G1/mean": float(speeds.mean()), "G1/sd": float(speeds.std(ddof=1))}


# --- all of them -----------------------------------------------------------------------------
DELAY_KEY = "link.down.delay_s"


_TILT_CELLS: dict[str, dict[str, Any]] = {
    tilt_cell(gain, name): {"device.gain": scale, "task.selection": selection}
    for gain, scale in GAINS.items()
    for name, selection in SELECTIONS.items()
}
_FRAME_CELLS: dict[str, dict[str, Any]] = {
    frame_cell(rate, delay): {"frames.rate_hz": rate, DELAY_KEY: delay}
    for rate in FRAME_RATES
    for delay in FRAME_DELAYS_S
}


def _both_ways(delay: float) -> dict[str, Any]:
    return {"link.up.delay_s": 0.5 * delay, DELAY_KEY: 0.5 * delay}


def _moving_cells() -> dict[str, dict[str, Any]]:
    return {
        moving_cell(added, speed): {
            "link.up.delay_s": LOCAL_S + added,
            "task.target_mps": speed,
        }
        for added in ADDED_S
        for speed in SPEEDS_MPS
    }


_QUICK = {"trials": 4, "practice": 1}
_ONE = {"trials": 1, "practice": 1}  # one trial in each of many conditions
_TWO = {"trials": 2, "practice": 1}
_FEW = {"trials": 3, "practice": 1}

EXPERIMENTS: tuple[Experiment, ...] = (
    Experiment(
        "lag", "fitts-lag", {lag: {DELAY_KEY: s} for lag, s in LAGS_S.items()}, lag_values, _ONE
    ),
    Experiment("tilt", "fitts-tilt", _TILT_CELLS, tilt_values, _TWO),
    Experiment("steering", "steering-law", {"tunnel": {}}, steering_values, _TWO),
    Experiment(
        "latency",
        "steering-law",
        {
            "less": {DELAY_KEY: LATENCY_S - STEP_S},
            "as it is": {DELAY_KEY: LATENCY_S},
            "more": {DELAY_KEY: LATENCY_S + STEP_S},
        },
        latency_values,
        _ONE,
    ),
    Experiment(
        "waiting", "move-and-wait", {f"{s:g}": _both_ways(s) for s in WAITS_S}, wait_values, _FEW
    ),
    Experiment(
        "excavator",
        "excavator",
        {"0": {DELAY_KEY: 0.0}, str(EXCAVATOR_S): {DELAY_KEY: EXCAVATOR_S}},
        excavator_values,
        _ONE,
    ),
    Experiment("tracking", "tracking", {"tracking": {}}, tracking_values),
    Experiment("frames", "frame-rate", _FRAME_CELLS, frame_values, _ONE),
    Experiment("moving", "moving-target", _moving_cells(), moving_values, _QUICK),
    Experiment(
        "standing",
        "standing-target",
        {str(added): {"link.up.delay_s": added} for added in LATER_S},
        standing_values,
        _ONE,
    ),
    Experiment(
        "rover",
        "course",
        {str(trip): _both_ways(trip) for trip in ROUND_TRIPS_S},
        rover_values,
        _ONE,
    ),
    Experiment(
        "tilt kinds",
        "tilt-position",
        {
            f"{kind}/{name}": {**changes, "task.selection": selection}
            for kind, changes in TILT_KINDS.items()
            for name, selection in SELECTIONS.items()
        },
        tilt_kind_values,
        _TWO,
    ),
    Experiment(
        "click",
        "one-click",
        {c: {"link.up.delay_s": s} for c, s in CLICK_S.items()},
        click_values,
        _QUICK,
    ),
    Experiment("pushed", "tracking-pushed", {"pushed": {}}, pushed_values, {"trials": 1}),
    Experiment("heading", "heading-step", {"heading": {}}, heading_values, _QUICK),
    Experiment("choices", None, {"accuracy": {}, "speed": {}}, choice_values),
    Experiment("vehicles", None, {"1": {}, "2": {}}, vehicle_values),
    Experiment("looks", None, {"two": {}}, look_values),
    Experiment("alarms", None, {"one": {}}, alarm_values),
    Experiment("items", None, {"open": {}}, item_values),
    Experiment("walkers", None, {"street": {}}, walker_values),
)
"""All experiments; the split file tells which of them may be fitted to."""


PERSONS = 24
QUICK_PERSONS = 6
FAILED = "{!r} could not be simulated"

Traits = Mapping[str, float]


@dataclass(frozen=True)
class OperatorsSetting:
    """Settings of the simulated experiments.

    Attributes:
        strategy: Strategy of the persons.
        seed: Random seed of all runs and persons.
        persons: Number of persons.
        quick: True for few trials.
        workers: Number of processes.
        traits: Medians that replace those of the population, for a fit.
    """

    strategy: str
    seed: int = 1
    persons: int = PERSONS
    quick: bool = False
    workers: int = 1
    traits: Traits | None = None


def play_exact(
    checks: Sequence[str], setting: OperatorsSetting, progress: Progress = lambda done: None
) -> dict[str, LineValue]:
    """Return the value of each line of the given exact checks, by id.

    Raises:
        RunsFailed: one of them could not be simulated.
    """
    jobs = [make_job(check, setting.seed, None) for check in checks]
    rows = play_jobs(jobs, perform_exact, setting.workers, FAILED, progress)
    values = ((job.config, row) for job in jobs for row in rows[job.key])
    return {f"{check}/{row['line']}": certain(float(row["value"])) for check, row in values}


def play_experiments(
    experiments: Sequence[Experiment],
    setting: OperatorsSetting,
    progress: Progress = lambda done: None,
) -> dict[str, Cells]:
    """Return the trials of each experiment, by its name.

    Raises:
        ConfigError: a task cannot be read, or there is no such strategy.
        RunsFailed: a trial failed.
    """
    jobs = {e.name: _jobs(e, setting) for e in experiments}
    every = [job for cells in jobs.values() for own in cells.values() for job in own]
    rows = play_jobs(every, perform, setting.workers, FAILED, progress)
    return {
        name: {
            cell: collect([(job.person, rows[job.key]) for job in own])
            for cell, own in cells.items()
        }
        for name, cells in jobs.items()
    }


def measured(
    experiments: Sequence[Experiment], played: Mapping[str, Cells], seed: int
) -> dict[str, LineValue]:
    """Return the value of each line with its interval, by its id."""
    estimates: dict[str, LineValue] = {}
    for experiment in experiments:
        rng = Streams(seed).fresh(f"resampling/{experiment.name}")
        estimates |= with_intervals(experiment.measure, played[experiment.name], rng)
    return estimates


def count_jobs(experiments: Sequence[Experiment], setting: OperatorsSetting) -> int:
    """Return the number of jobs in the experiments."""
    return sum(len(e.cells) for e in experiments) * setting.persons


def perform_exact(job: StudyJob) -> Tables:
    """Return one exact check."""
    values = MODEL_CHECKS[job.config](job.seed)
    return {"rows": [{"line": line, "value": value} for line, value in values.items()]}


def perform(job: StudyJob) -> Tables:
    """Return all trials of one person in one cell."""
    if "population" in job.levels:
        part, cell = job.config.split("/")
        return {"rows": PARTS[part](_asked_person(job), cell, job.seed)}
    return {"rows": play(cast(TaskScenario, job.scenario), job.seed)}


def _asked_person(job: StudyJob) -> Person:
    """Return the person for a job, drawn from the population that it names."""
    levels = job.levels
    everybody = population(OperatorConfig()).with_medians(json.loads(str(levels["traits"])))
    return draw_person(everybody, int(str(levels["population"])), job.person)


def _jobs(experiment: Experiment, setting: OperatorsSetting) -> dict[str, list[StudyJob]]:
    """Return jobs of each cell; a person meets the same random numbers in all of them."""
    jobs: dict[str, list[StudyJob]] = {cell: [] for cell in experiment.cells}
    if experiment.scenario is None:
        traits = json.dumps(setting.traits or {})
        for cell, person in product(experiment.cells, range(setting.persons)):
            seed = derive_seed("operators", experiment.name, setting.seed, person)
            name = f"{experiment.name}/{cell}"
            job = make_job(name, seed, None, person=person, population=setting.seed, traits=traits)
            jobs[cell].append(job)
        return jobs
    document = load_yaml(resources.find(experiment.scenario, FOLDER))
    for cell, changes in experiment.cells.items():
        every = {**changes, **(experiment.quick if setting.quick else {})}
        every |= {"operator.strategy": setting.strategy, "operator.population_seed": setting.seed}
        every |= {f"operator.traits.{t}": v for t, v in (setting.traits or {}).items()}
        for person in range(setting.persons):
            scenario = build(document, {**every, "operator.person": person})
            seed = derive_seed("operators", experiment.name, setting.seed, person)
            name = f"{experiment.name}/{cell}"
            jobs[cell].append(make_job(name, seed, scenario, person=person))
    return jobs
