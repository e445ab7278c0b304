"""Verdicts on a study's measured rows: inside the predicted band, outside, or not judged."""

from __future__ import annotations

import csv
import gzip
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.cell_grid import cells, jobs
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.units import unit_of
from dva_sim.simulation.measures.middleware import RUN_COLUMNS, command_row
from dva_sim.simulation.middleware import MiddlewareScenario
from dva_sim.simulation.middleware.run import Window
from dva_sim.validation.evidence import RULE, Evidence, judged, share_rule, short_number
from dva_sim.validation.evidence_page import ValidationResult
from dva_sim.validation.network.beside.predictions import (
    ALLOWANCES,
    AskedCell,
    CellPrediction,
    plays_in,
    predict_all,
    read_kept,
    rows_of,
)

STUDY: Final = "middleware"  # study that measured the kept commands
MIN_RUNS: Final = 3  # minimum undisturbed runs for judging a median
MIN_INSIDE: Final = 0.90  # share of the rows that are judged
MEANINGS: Final = {column.name: column.meaning for column in RUN_COLUMNS}
NOT_JUDGED: Final = "not judged"


def asked_by(study: Study, results: Results | None = None) -> list[AskedCell]:
    """Return the middleware configurations of a study, with the seeds of their runs.

    Args:
        results: Results of the study, perhaps with other scenarios.

    Raises:
        ConfigError: there is none, or a file that the study names cannot be read.
    """
    grid = cells(study)
    seeds: dict[str, dict[int, None]] = {}
    for job in jobs(study, grid):
        seeds.setdefault(job.config, {})[job.seed] = None
    rows = [] if results is None else results.manifest["cells"]
    as_run = {(row["part"], row["cell"]): str(row["config"]) for row in rows}
    by_config = {}
    for cell in grid:
        if isinstance(cell.scenario, MiddlewareScenario):
            config = as_run.get((cell.part, cell.cell), cell.config)
            levels = {factor: str(level) for factor, level in cell.levels.items()}
            scenario = cell.scenario if config == cell.config else None
            by_config[config] = AskedCell(config, levels, scenario, tuple(seeds[cell.config]))
    if not by_config:
        raise ConfigError("the study has no part whose model is middleware")
    return list(by_config.values())


@dataclass(frozen=True)
class Measured:
    """The runs of one configuration.

    Attributes:
        values: Values of each measure, without runs that the machine disturbed.
        disturbed: Number of disturbed runs.
    """

    values: Mapping[str, Sequence[float]]
    disturbed: int = 0


def measured_in(results: Results) -> dict[str, Measured]:
    """Return the runs of a study's results, by configuration.

    Raises:
        ConfigError: they are not those of a middleware study, or cannot be read.
    """
    runs = results.runs
    missing = [name for name in (*ALLOWANCES, "disturbed") if runs.rows and name not in runs]
    if missing:
        raise ConfigError(f"{results.folder} has no column {missing[0]}: not a middleware study")
    values_of_cells = {}
    for config in dict.fromkeys(runs.get("config", ())):
        own = runs.where(runs["config"] == config)
        disturbed = own["disturbed"].astype(float) > 0
        quiet = own.where(~disturbed)
        values = {name: quiet[name].astype(float).tolist() for name in ALLOWANCES}
        values_of_cells[str(config)] = Measured(values, int(disturbed.sum()))
    return values_of_cells


def measured_in_commands(path: Path, asked_cells: Sequence[AskedCell]) -> dict[str, Measured]:
    """Return the kept commands of a study, by configuration.

    The table does not tell which runs were disturbed.

    Args:
        path: A table of commands, by middleware, link and person: when each was made and when it
            was applied, [s] from the start of its run.
        asked_cells: The study's configurations.

    Raises:
        ConfigError: the table cannot be read.
    """
    times: dict[tuple[str, ...], dict[str, list[tuple[float, float]]]] = {}
    try:
        with gzip.open(path, "rt", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                run = times.setdefault((row["middleware"], row["link"]), {})
                own = run.setdefault(row["person"], [])
                if row["arrived_s"]:
                    own.append((float(row["made_s"]), float(row["arrived_s"])))
    except (OSError, KeyError, ValueError, csv.Error) as error:
        raise ConfigError(f"cannot be read as a table of commands: {error}", path) from None
    return {
        cell.config: Measured(
            _measures(cell.scenario, times[cell.levels["middleware"], cell.levels["link"]].values())
        )
        for cell in asked_cells
        if cell.scenario is not None
    }


def _measures(
    scenario: MiddlewareScenario, runs: Iterable[Sequence[tuple[float, float]]]
) -> dict[str, list[float]]:
    """Return the measures of some runs by the newest command at each time, as a run takes them."""
    window = Window(0.0, scenario.set_up_s, scenario.set_up_s + scenario.measure_s)
    rows = []
    for run in runs:
        ordered = sorted(run, key=lambda times: times[1])
        made, applied = np.array(ordered, dtype=float).reshape(-1, 2).T
        robot = scenario.robot
        limits = {"max_age_s": robot.max_age_s, "watchdog_s": robot.watchdog_s}
        rows.append(command_row(made, applied, window, **limits))
    return {name: [row[name] for row in rows if name in row] for name in ALLOWANCES}


def lines_beside(
    predictions: Sequence[CellPrediction], measured: Mapping[str, Measured] | None
) -> list[Evidence]:
    """Return every measure of every configuration, with the measured value if there is one."""
    lines = []
    for measure in ALLOWANCES:
        for prediction in predictions:
            own = None if measured is None else measured.get(prediction.config, Measured({}))
            lines.append(_line(prediction, measure, own))
    return lines


def _line(prediction: CellPrediction, measure: str, own: Measured | None) -> Evidence:
    values = () if own is None else own.values.get(measure, ())
    median = float(np.median(values)) if len(values) else None
    line = Evidence(
        "middleware",
        f"{measure}: {MEANINGS[measure]}",
        " ".join((*prediction.levels.values(), measure)),
        MEANINGS[measure],
        source="the study's runs over real middleware",
        unit=unit_of(measure),
        measured=median,
        holds_measured=True,
        sample=len(values),
        note=f"not predicted: {prediction.why}",
    )
    band = prediction.bands.get(measure)
    if band is None:
        return line
    line = replace(line, predicted=band.predicted, low=band.low, high=band.high, note="predicted")
    if own is None:
        return line
    if len(values) < MIN_RUNS or median is None:
        late = f", {own.disturbed} more were disturbed" if own.disturbed else ""
        return replace(line, note=f"{NOT_JUDGED}: {len(values)} of at least {MIN_RUNS} runs{late}")
    ends = f"runs from {short_number(min(values))} to {short_number(max(values))}"
    return replace(line, verdict="holds" if band.holds(median) else "misses", note=ends)


def rule_of(lines: Sequence[Evidence]) -> Evidence:
    """Return the share of rows inside their bands.

    It misses if the measured values cannot be judged.
    """
    verdicts = [line.verdict for line in judged(lines)]
    if verdicts:
        held = verdicts.count("holds")
        return share_rule("middleware", "rows", held, len(verdicts), least=MIN_INSIDE)
    is_empty = any(line.note.startswith(NOT_JUDGED) for line in lines)
    return Evidence(
        "middleware",
        RULE,
        "rows",
        "share that holds",
        low=MIN_INSIDE,
        verdict="misses" if is_empty else "shown only",
        note="nothing is judged",
    )


def beside_of(
    asked_cells: Sequence[AskedCell],
    measured: Mapping[str, Measured] | None,
    plays: int,
    workers: int,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> ValidationResult:
    """Return predictions with measured values, computing only bands that were not kept.

    Args:
        asked_cells: The configurations.
        measured: Runs of each configuration; None: all are predicted now, without measured values.
        plays: Number of simulated runs per seed.
        workers: Processes.
        progress: Callback with the number of finished runs, and of all runs.

    Raises:
        RunsFailed: a play failed.
    """
    kept_values = read_kept() if measured is not None else {}
    kept_by_config = {
        cell.config: kept_values.get((cell.config, cell.seeds)) for cell in asked_cells
    }
    todo = [cell for cell in asked_cells if not kept_by_config[cell.config]]
    of = plays_in(todo, plays)
    played = {
        prediction.config: prediction
        for prediction in predict_all(todo, plays, workers, lambda done: progress(done, of))
    }
    predictions = [
        played.get(cell.config)
        or CellPrediction(cell.config, cell.levels, cell.seeds, kept_by_config[cell.config] or {})
        for cell in asked_cells
    ]
    lines = lines_beside(predictions, measured)
    notes = []
    if kept_here := len(asked_cells) - len(todo):
        notes = [f"The bands of {kept_here} configurations were kept before they were measured."]
    table = rows_of([prediction for prediction in predictions if prediction.config in played])
    if table:
        notes.append(f"{len(table)} configurations were played now, by the model as it is.")
    return ValidationResult(
        [*lines, rule_of(lines)],
        notes=notes,
        tables={"predictions": table} if table else {},
    )
