"""What is compared: one number per run and measure, from sockets and from the model alike."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.validation.network.kinds import Group

Floats = NDArray[np.float64]
Row = Mapping[str, float]


@dataclass(frozen=True)
class Measure:
    """One thing that is compared.

    Attributes:
        name: Its column.
        words: What it is.
        unit: Of its values.
    """

    name: str
    words: str
    unit: str

    @property
    def is_time(self) -> bool:
        """Whether bands in milliseconds belong to it."""
        return self.unit == "ms"

    @property
    def is_tail(self) -> bool:
        """Whether it is a 95th percentile."""
        return self.name.endswith("_p95")


MEASURES = (
    Measure("applied_hz", "commands applied per second", "1/s"),
    Measure("age_p50", "age when applied, median", "ms"),
    Measure("age_p95", "age when applied, 95th percentile", "ms"),
    Measure("stale_p50", "age while in force, median", "ms"),
    Measure("stale_p95", "age while in force, 95th percentile", "ms"),
    Measure("rtt_p50", "round trip, median", "ms"),
    Measure("rtt_p95", "round trip, 95th percentile", "ms"),
    Measure("delivered", "delivered share", ""),
    Measure("queue", "commands under way", ""),
    Measure("timeouts", "time-outs", ""),
    Measure("alerts", "alerts", ""),
)
BY_NAME = {measure.name: measure for measure in MEASURES}
JUDGED_EXACTLY = MEASURES[:7]
"""What has a band without loss; the rest is shown there."""


def values_of(row: Row) -> dict[str, float]:
    """The measures of one run, from the columns of results.

    Those that have no column of their own:

    - `delivered`: different commands applied over commands sent, in the window;
    - `queue`: commands sent and not yet applied, on average, by Little's law from the rate of
      applications and their mean age.
    """
    sent, rate, age = row["n_sent"], row["applied_hz"], row["age_mean"]
    found = {m.name: row[m.name] for m in MEASURES if m.name in row}
    found["delivered"] = row["n_distinct"] / sent if sent else math.nan
    found["queue"] = rate * age / 1000.0 if rate else 0.0
    return found


@dataclass(frozen=True)
class Cell:
    """One measure of one condition, measured and predicted.

    Attributes:
        group: The condition with what was measured.
        measure: What is compared.
        measured: A value for each run on sockets, without those that are not defined.
        predicted: The same of the model's runs.
    """

    group: Group
    measure: Measure
    measured: Floats
    predicted: Floats

    @property
    def real(self) -> float:
        """Mean of what was measured."""
        return float(self.measured.mean()) if len(self.measured) else math.nan

    @property
    def model(self) -> float:
        """Mean of what was predicted."""
        return float(self.predicted.mean()) if len(self.predicted) else math.nan

    @property
    def off(self) -> float:
        """How far the prediction is off, as a share of what was measured."""
        return self.model / self.real - 1 if self.real else math.nan


def cells_of(group: Group, predicted: Sequence[Row]) -> list[Cell]:
    """Every measure of a condition that is defined on either side.

    Time-outs and alerts are a requester's.
    """
    real = [values_of(run.values) for run in group.runs]
    model = [values_of(row) for row in predicted]
    asked = MEASURES if group.condition.pattern == "req" else MEASURES[:-2]
    cells = [Cell(group, m, _column(real, m), _column(model, m)) for m in asked]
    return [cell for cell in cells if len(cell.measured) or len(cell.predicted)]


def _column(rows: Sequence[Row], measure: Measure) -> Floats:
    values = np.array([row.get(measure.name, math.nan) for row in rows], dtype=float)
    return np.asarray(values[~np.isnan(values)])
