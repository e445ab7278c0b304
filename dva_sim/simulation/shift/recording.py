"""What is left of a timed run."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.simulation.shift.scenario import TimedScenario
from dva_sim.simulation.shift.statistics import CODES, COUNT, MEASURES, SQUARES, SUM, WAITED, Floats


@dataclass
class UnitRecord:
    """One responder over the measured time.

    Attributes:
        name: For people.
        kind: `guard` or `robot`.
        spent: Time by phase [s]: `ready`, `travel`, `look`, `act`, `stand by`, `return`.
        exposure: Time within danger radii by stage [s]: `approach`, `look`, `act`, `leave`.
        distance: What it has gone in the whole run [m].
        jobs: Orders it has settled in the whole run, by task.
    """

    name: str
    kind: str
    spent: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    exposure: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    distance: float = 0.0
    jobs: Counter[str] = field(default_factory=Counter)

    @property
    def busy(self) -> float:
        """Time with an order [s]."""
        return sum(self.spent.values())


@dataclass
class TimedRecording:
    """One run.

    Attributes:
        scenario: What it consisted of.
        seed: What decided its luck.
        zones: Names by the number in the column `zone`.
        streams: Names by the number in the column `stream`.
        responders: Names by the number in the columns `responder` and `actor`.
        columns: One array each of `COLUMNS`, a row for each event of the world in order of
            outbreak; empty where only batches are kept. Times [s]; nan: never; -1: nobody.
        cells: Sums over the events first reported in each batch of the measured time, shape
            `(streams, batches, CELL)`; see `total`.
        outcomes: Events first reported in each batch by what became of them, shape
            `(streams, batches, OUTCOMES)`.
        waiting: Integral over time of how many events wait, shape `(streams, batches)` [s].
        served: The same of those that somebody is at.
        units: Each responder.
        operators: Time that each operator had an order [s].
        counters: What the DVA counted; `refused ...`: its answers other than OK.
        violations: Rules found broken, by what; empty if all is well.
        events: Events of the world.
        messages: What the DVA's desk took.
        ended: When the run ended [s].
        duration: Measured time [s].
    """

    scenario: TimedScenario
    seed: int
    zones: list[str]
    streams: list[str]
    responders: list[str]
    columns: dict[str, Floats | NDArray[np.int64]]
    cells: Floats
    outcomes: NDArray[np.int64]
    waiting: Floats
    served: Floats
    units: list[UnitRecord]
    operators: list[float]
    counters: Counter[str]
    violations: Counter[str]
    events: int
    messages: int
    ended: float
    duration: float

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Rows of events first reported within the measured time, shape `(n,)`."""
        since, until = self.scenario.warm_up_s, self.scenario.horizon_s
        detected = self.columns["detected"]
        return np.asarray((detected >= since) & (detected <= until))

    def count(self, *outcomes: str, stream: int | None = None) -> int:
        """Events first reported within the measured time that ended so; none named: all."""
        codes = [CODES[o] for o in outcomes] or list(CODES.values())
        return int(self._of(self.outcomes, stream)[..., codes].sum())

    def total(self, measure: str, stream: int | None = None) -> tuple[float, float, float]:
        """Count, sum [s] and sum of squares [s^2] of one of `MEASURES`."""
        place = MEASURES.index(measure)
        cells = self._of(self.cells, stream).reshape(-1, self.cells.shape[-1]).sum(axis=0)
        return float(cells[COUNT + place]), float(cells[SUM + place]), float(cells[SQUARES + place])

    def mean(self, measure: str, stream: int | None = None) -> float:
        """Mean of one of `MEASURES` [s]; nan if there was none."""
        count, total, _ = self.total(measure, stream)
        return total / count if count else math.nan

    def batch_means(self, measure: str, stream: int | None = None) -> Floats:
        """Mean of one of `MEASURES` in each batch [s], shape `(batches,)`; nan: none there."""
        place = MEASURES.index(measure)
        cells = self._of(self.cells, stream).sum(axis=0)
        counts, sums = cells[:, COUNT + place], cells[:, SUM + place]
        return np.asarray(np.where(counts > 0, sums / np.maximum(counts, 1.0), math.nan))

    def waited(self, stream: int | None = None) -> float:
        """Share of the events somebody was sent to that had to wait for it."""
        count = self.total("wait", stream)[0]
        return float(self._of(self.cells, stream)[..., WAITED].sum()) / count if count else math.nan

    def mean_waiting(self, stream: int | None = None) -> float:
        """How many events wait, on average over the measured time."""
        return float(self._of(self.waiting, stream).sum()) / self.duration

    def mean_served(self, stream: int | None = None) -> float:
        """How many events somebody is at, on average over the measured time."""
        return float(self._of(self.served, stream).sum()) / self.duration

    def utilisation(self, unit: int) -> float:
        """Share of the measured time that a responder had an order."""
        return self.units[unit].busy / self.duration

    @property
    def exposure(self) -> float:
        """Time of all guards within danger radii [s]."""
        return float(sum(sum(unit.exposure.values()) for unit in self.units))

    def _of(self, table: NDArray[Any], stream: int | None) -> NDArray[Any]:
        return table if stream is None else table[stream : stream + 1]
