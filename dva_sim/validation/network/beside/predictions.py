"""Predictions of the model for each configuration of a middleware study, with bands.

The rule is fixed here, before any run of a study is looked at:

- A configuration is played `PLAYS` times for each random seed of the study. Plays of one seed
  differ by when the programs have started, and so by the packets that are lost.
- One play of each seed is drawn, `DRAWS` times over, and the median over the seeds is taken: that
  is what a study's repeats will show. The prediction is the median of these medians, its band
  reaches from their 2.5th to their 97.5th percentile.
- The band is made wider by what the model leaves out: a share of the value, and an amount. Times
  have 2 % and 5 ms (`LATE_S`: a run whose link was later counts as disturbed), gaps twice the
  5 ms because either end of one may be late; rates 2 % and one command of the whole window; the
  share of time with an old command one hundredth; bytes 5 % and one full packet, since openings and
  farewells are known in outline only.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.kernel import resources
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import derive_seed
from dva_sim.network.emulator.report import LATE_S
from dva_sim.network.middleware import load_transport
from dva_sim.network.transports.message_parts import PACKET
from dva_sim.simulation.middleware import MiddlewareScenario
from dva_sim.simulation.models import Tables
from dva_sim.validation.frame import Progress, Row, make_job, play_jobs
from dva_sim.validation.network.beside.carriers import why_not
from dva_sim.validation.network.beside.virtual_run import ProgramTimes, VirtualRun
from dva_sim.validation.network.reference import FOLDER

PLAYS = 20  # number of plays for each seed
QUICK_PLAYS = 5  # number of plays for each seed in a quick validation
DRAWS: Final = 4000
INTERVAL: Final = (2.5, 97.5)
KEPT: Final = "middleware-predictions"
"""Table of the predictions of the shipped study, made before its measured rows were read."""


class Allowance(NamedTuple):
    """Allowance for effects outside the model: a share of the value, plus an amount."""

    share: float
    amount: Callable[[MiddlewareScenario], float]


def _always(amount: float) -> Callable[[MiddlewareScenario], float]:
    return lambda scenario: amount


ALLOWANCES: Final[Mapping[str, Allowance]] = {
    "age_in_force_p50_s": Allowance(0.02, _always(LATE_S)),
    "age_in_force_p95_s": Allowance(0.02, _always(LATE_S)),
    "too_old_share": Allowance(0.0, _always(0.01)),
    "longest_gap_s": Allowance(0.02, _always(2 * LATE_S)),
    "command_rate_hz": Allowance(0.02, lambda scenario: 1.0 / scenario.measure_s),
    "up_bytes": Allowance(0.05, _always(PACKET)),
    "down_bytes": Allowance(0.05, _always(PACKET)),
}
"""The measures that are predicted."""


class PredictedBand(NamedTuple):
    """A prediction, and the band in which the measured value should lie."""

    low: float
    predicted: float
    high: float

    def holds(self, value: float) -> bool:
        """Return True if a measured value lies inside."""
        return self.low <= value <= self.high


@dataclass(frozen=True)
class CellPrediction:
    """Prediction for one configuration.

    Attributes:
        config: Its hash.
        levels: Its level of each factor.
        seeds: Random seeds of the study's runs.
        bands: Bands by measure; none without a prediction.
        why: Reason for not predicting it.
    """

    config: str
    levels: Mapping[str, str]
    seeds: tuple[int, ...]
    bands: Mapping[str, PredictedBand]
    why: str = ""


@dataclass(frozen=True)
class AskedCell:
    """One configuration to predict.

    Attributes:
        config: Its hash.
        levels: Its level of each factor.
        scenario: Scenario to run; None if it has changed since the measurement.
        seeds: Random seeds of the study's runs.
    """

    config: str
    levels: Mapping[str, str]
    scenario: MiddlewareScenario | None
    seeds: tuple[int, ...]

    @property
    def why_not(self) -> str:
        """Reason why the model does not cover the configuration; empty if it does."""
        if self.scenario is None:
            return "its scenario has changed since it was run"
        choice = self.scenario.transport
        return why_not(load_transport(choice.name, choice.options)())


def predict_all(
    cells: Sequence[AskedCell], plays: int, workers: int, progress: Progress = lambda done: None
) -> list[CellPrediction]:
    """Return the predictions of some configurations, in their order.

    Raises:
        RunsFailed: a play failed.
    """
    played = [cell for cell in cells if not cell.why_not]
    jobs = {
        (cell.config, seed): make_job(cell.config, seed, cell.scenario, plays=plays)
        for cell in played
        for seed in cell.seeds
    }
    rows = play_jobs(list(jobs.values()), perform, workers, "{} could not be played", progress, len)
    predictions = []
    for cell in cells:
        bands = {}
        if not cell.why_not:
            by_seed = [rows[jobs[cell.config, seed].key] for seed in cell.seeds]
            bands = _bands(cell, by_seed)
        predictions.append(
            CellPrediction(cell.config, cell.levels, cell.seeds, bands, cell.why_not)
        )
    return predictions


def plays_in(cells: Sequence[AskedCell], plays: int) -> int:
    """Return the number of runs needed."""
    return sum(plays * len(cell.seeds) for cell in cells if not cell.why_not)


def perform(job: StudyJob) -> Tables:
    """Return the plays of one seed of one configuration."""
    scenario = job.scenario
    plays = int(str(job.levels["plays"]))
    assert isinstance(scenario, MiddlewareScenario)
    rows = []
    for play in range(plays):
        rng = np.random.default_rng(derive_seed("beside", job.config, job.seed, play))
        row = VirtualRun(scenario, job.seed, ProgramTimes.drawn(rng)).play()
        rows.append({measure: row[measure] for measure in ALLOWANCES})
    return {"rows": rows}


def _bands(cell: AskedCell, by_seed: Sequence[Sequence[Row]]) -> dict[str, PredictedBand]:
    assert cell.scenario is not None
    rng = np.random.default_rng(derive_seed("bands", cell.config))
    plays = len(by_seed[0])
    seeds = range(len(by_seed))
    drawn = rng.integers(plays, size=(DRAWS, len(by_seed)))
    bands = {}
    for measure, allowance in ALLOWANCES.items():
        values = np.array([[row[measure] for row in rows] for rows in by_seed], dtype=float)
        medians = np.median(values[seeds, drawn], axis=1)
        low, high = np.percentile(medians, INTERVAL)
        bands[measure] = widened(
            PredictedBand(float(low), float(np.median(medians)), float(high)),
            allowance,
            cell.scenario,
        )
    return bands


def widened(
    band: PredictedBand, allowance: Allowance, scenario: MiddlewareScenario
) -> PredictedBand:
    """Return a band with a margin for effects outside of the model; its low end is at least 0."""
    low, predicted, high = band
    amount = allowance.amount(scenario)
    return PredictedBand(
        max(0.0, low - allowance.share * low - amount),
        predicted,
        high + allowance.share * high + amount,
    )


# --- the table that is kept ------------------------------------------------------------------
def rows_of(predictions: Sequence[CellPrediction]) -> list[Row]:
    """Return a row for each configuration that is predicted."""
    return [
        {
            **prediction.levels,
            **{
                f"{measure}{end}": round(value, 6)
                for measure, band in prediction.bands.items()
                for end, value in zip(("_low", "", "_high"), band, strict=True)
            },
            "config": prediction.config,
            "seeds": " ".join(map(str, prediction.seeds)),
        }
        for prediction in predictions
        if prediction.bands
    ]


def read_kept(name: str = KEPT) -> dict[tuple[str, tuple[int, ...]], dict[str, PredictedBand]]:
    """Return the bands of a kept table, by configuration and seeds.

    Raises:
        ConfigError: it cannot be read, or something is missing in it.
    """
    path = resources.find(name, FOLDER, ".csv")
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return {_key(row): _kept_bands(row) for row in csv.DictReader(file)}
    except (OSError, KeyError, ValueError, csv.Error) as error:
        raise ConfigError(f"cannot be read as a table of predictions: {error}", path) from None


def _key(row: Mapping[str, str]) -> tuple[str, tuple[int, ...]]:
    return row["config"], tuple(int(seed) for seed in row["seeds"].split())


def _kept_bands(row: Mapping[str, str]) -> dict[str, PredictedBand]:
    ends = ("_low", "", "_high")
    return {m: PredictedBand(*(float(row[f"{m}{end}"]) for end in ends)) for m in ALLOWANCES}
