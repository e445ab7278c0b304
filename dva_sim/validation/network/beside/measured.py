"""A study's measured rows beside the predictions: inside the band, outside, or why neither."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.cell_grid import cells, jobs
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.middleware import MiddlewareScenario
from dva_sim.validation.network.beside.predictions import (
    ALLOWANCES,
    AskedCell,
    CellPrediction,
    PredictedBand,
    plays_in,
    predict_all,
    read_kept,
)

MIN_RUNS: Final = 3  # undisturbed ones, of which a median is judged
MIN_INSIDE: Final = 0.90  # share of the rows that are judged
BesideWord = Literal["inside", "outside", "predicted", "not predicted", "not judged"]


def asked_by(study: Study, results: Results | None = None) -> list[AskedCell]:
    """The middleware configurations of a study, with the seeds of their runs.

    Args:
        results: Those of the study, whose scenarios may have been others.

    Raises:
        ConfigError: there is none, or a file that the study names cannot be read.
    """
    grid = cells(study)
    seeds: dict[str, dict[int, None]] = {}
    for job in jobs(study, grid):
        seeds.setdefault(job.config, {})[job.seed] = None
    rows = [] if results is None else results.manifest["cells"]
    as_run = {(row["part"], row["cell"]): str(row["config"]) for row in rows}
    found = {}
    for cell in grid:
        if isinstance(cell.scenario, MiddlewareScenario):
            config = as_run.get((cell.part, cell.index), cell.config)
            levels = {factor: str(level) for factor, level in cell.levels}
            scenario = cell.scenario if config == cell.config else None
            found[config] = AskedCell(config, levels, scenario, tuple(seeds[cell.config]))
    if not found:
        raise ConfigError("the study has no part whose model is middleware")
    return list(found.values())


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
    """The runs of a study's results, by configuration.

    Raises:
        ConfigError: they are not those of a middleware study, or cannot be read.
    """
    runs = results.runs
    missing = [name for name in (*ALLOWANCES, "disturbed") if runs.rows and name not in runs]
    if missing:
        raise ConfigError(f"{results.folder} has no column {missing[0]}: not a middleware study")
    found = {}
    for config in dict.fromkeys(runs.get("config", ())):
        own = runs.where(runs["config"] == config)
        disturbed = own["disturbed"].astype(float) > 0
        quiet = own.where(~disturbed)
        values = {name: quiet[name].astype(float).tolist() for name in ALLOWANCES}
        found[str(config)] = Measured(values, int(disturbed.sum()))
    return found


@dataclass(frozen=True)
class BesideRow:
    """One measure of one configuration.

    Attributes:
        levels: Its level of each factor.
        values: Measured values, run by run.
        band: The prediction; None where the model says nothing.
        why: Reason for not predicting, or for not judging the row.
    """

    levels: Mapping[str, str]
    measure: str
    values: Sequence[float]
    band: PredictedBand | None
    why: str = ""

    @property
    def median(self) -> float:
        """Median of the measured values; nan without any."""
        return float(np.median(self.values)) if len(self.values) else float("nan")

    @property
    def word(self) -> BesideWord:
        """The verdict."""
        if self.band is None:
            return "not predicted"
        if self.why:
            return "not judged"
        if not len(self.values):
            return "predicted"
        return "inside" if self.band.holds(self.median) else "outside"


def rows_beside(
    predictions: Sequence[CellPrediction], measured: Mapping[str, Measured] | None
) -> list[BesideRow]:
    """Every measure of every configuration, with what was measured, if anything was."""
    rows = []
    for prediction in predictions:
        own = None if measured is None else measured.get(prediction.config, Measured({}))
        for measure in ALLOWANCES:
            values = () if own is None else own.values.get(measure, ())
            band = prediction.bands.get(measure)
            why = prediction.why if band is None else "" if own is None else _against(own, values)
            rows.append(BesideRow(prediction.levels, measure, values, band, why))
    return rows


def _against(own: Measured, values: Sequence[float]) -> str:
    """Reason why a predicted row is not judged; empty if it is."""
    if len(values) >= MIN_RUNS:
        return ""
    late = f", {own.disturbed} more were disturbed" if own.disturbed else ""
    return f"{len(values)} of at least {MIN_RUNS} runs{late}"


@dataclass(frozen=True)
class Beside:
    """Comparison of measured rows with predicted bands.

    Attributes:
        rows: Every measure of every configuration.
        kept: Configurations whose bands were kept before the study was measured.
        played: New predictions.
    """

    rows: Sequence[BesideRow]
    kept: int = 0
    played: Sequence[CellPrediction] = ()

    def with_word(self, *words: BesideWord) -> list[BesideRow]:
        """The rows with one of some verdicts."""
        return [row for row in self.rows if row.word in words]

    @property
    def share(self) -> tuple[int, int]:
        """Number of judged rows inside their bands, and number of judged rows."""
        return len(self.with_word("inside")), len(self.with_word("inside", "outside"))

    @property
    def passes(self) -> bool:
        """True if enough rows lie inside; False if something was measured and nothing judged."""
        inside, judged = self.share
        is_empty = not judged and bool(self.with_word("not judged"))
        return inside >= MIN_INSIDE * judged and not is_empty


def beside_of(
    asked: Sequence[AskedCell],
    measured: Mapping[str, Measured] | None,
    plays: int,
    workers: int,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> Beside:
    """Predict some configurations, as far as no bands were kept, beside what was measured.

    Args:
        asked: The configurations.
        measured: The runs of each; None if there are none, and all are predicted now.
        plays: Number of simulated runs per seed.
        workers: Processes.
        progress: Callback with the number of finished runs, and of all runs.

    Raises:
        RunsFailed: a play failed.
    """
    kept = read_kept() if measured is not None else {}
    known = {cell.config: kept.get((cell.config, cell.seeds)) for cell in asked}
    todo = [cell for cell in asked if not known[cell.config]]
    of = plays_in(todo, plays)
    played = {
        prediction.config: prediction
        for prediction in predict_all(todo, plays, workers, lambda done: progress(done, of))
    }
    predictions = [
        played.get(cell.config)
        or CellPrediction(cell.config, cell.levels, cell.seeds, known[cell.config] or {})
        for cell in asked
    ]
    now = [prediction for prediction in predictions if prediction.config in played]
    return Beside(rows_beside(predictions, measured), len(asked) - len(todo), now)
