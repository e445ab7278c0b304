"""Results of a timed run: a row for each event or sums for each batch, and integrals.

The integrals are summed up over time from how many events wait and are served; waits are taken
from the events' own times. So each checks the other (Little's law).
"""

from __future__ import annotations

import math
from array import array
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.core.events import Event
from dva_sim.simulation.timed.incidents import Incident
from dva_sim.simulation.timed.scenario import TimedScenario

Floats = NDArray[np.float64]

TIMES = (
    "assigned",
    "departed",
    "arrived",
    "confirmed",
    "act_assigned",
    "act_departed",
    "act_arrived",
    "contained",
    "closed",
)
COLUMNS = (
    "number",
    "stream",
    "index",
    "zone",
    "x",
    "y",
    "true",
    "severity",
    "occurred",
    "detected",
    *TIMES,
    "outcome",
    "responder",
    "actor",
    "attempts",
    "preemptions",
    "reports",
    "event",
    "shared",
)
WHOLE = frozenset(COLUMNS) - {"x", "y", "severity", "occurred", "detected", *TIMES}
OUTCOMES = (
    "unnoticed",
    "refused",
    "pending",
    "assigned",
    "on scene",
    "confirmed",
    "contained",
    "refuted",
    "escalated",
    "expired",
)
"""State of an event; a confirmed one stays open while it needs containment."""

STEPS_IN_ORDER = ("detected", "assigned", "departed", "arrived", "confirmed", "contained", "closed")
CODES = {name: code for code, name in enumerate(OUTCOMES)}
MEASURES = ("wait", "response", "confirmation", "sojourn")
"""From the first report to the (last) assignment, arrival, confirmation and end [s]."""

WAITED = 0
COUNT = 1
SUM = 1 + len(MEASURES)
SQUARES = 1 + 2 * len(MEASURES)
CELL = 1 + 3 * len(MEASURES)
NO_WAIT_S = 1e-9  # shorter waits count as none [s]
_NAN = math.nan


# The first ten columns.
_known_of = attrgetter(
    "number",
    "stream",
    "index",
    "place.zone",
    "place.x",
    "place.y",
    "true",
    "severity",
    "occurred",
    "noticed",
)


class Slices:
    """The measured time, in parts of equal length.

    Args:
        start: [s]
        end: [s]
        count: Number of parts.
    """

    def __init__(self, start: float, end: float, count: int) -> None:
        self.start = start
        self.end = end
        self.count = count
        self.width = (end - start) / count

    def of(self, time: float) -> int | None:
        """Return the part that a time [s] lies in; None outside."""
        if not self.start <= time <= self.end:
            return None
        return min(int((time - self.start) / self.width), self.count - 1)


class Level:
    """Number of something, integrated over the measured time.

    Attributes:
        now: Current number.
        areas: Integral over each part [s].
    """

    __slots__ = ("_last", "_slices", "areas", "now")

    def __init__(self, slices: Slices) -> None:
        self.now = 0
        self.areas = [0.0] * slices.count
        self._slices = slices
        self._last = 0.0

    def change(self, by: int, time: float) -> None:
        """Change how many there are from `time` [s] on."""
        if self.now:
            self.advance(time)
        self._last = time
        self.now += by

    def advance(self, time: float) -> None:
        """Sum up to `time` [s]."""
        slices = self._slices
        since = self._last
        self._last = time
        since = max(since, slices.start)
        until = min(time, slices.end)
        while since < until:
            part = min(int((since - slices.start) / slices.width), slices.count - 1)
            end = until
            if part < slices.count - 1:
                end = min(until, slices.start + (part + 1) * slices.width)
            if end <= since:  # the border itself, by rounding
                part += 1
                end = min(until, slices.start + (part + 1) * slices.width)
            self.areas[part] += self.now * (end - since)
            since = end


class Ledger:
    """Rows or sums.

    Args:
        streams: Number of streams.
        slices: Parts of the measured time.
        rows: True to keep a row for each event.
    """

    def __init__(self, streams: int, slices: Slices, rows: bool) -> None:
        self._slices = slices
        self._rows = array("d") if rows else None
        self._cells = [[[0.0] * CELL for _ in range(slices.count)] for _ in range(streams)]
        self._outcomes = [
            [[0] * len(OUTCOMES) for _ in range(slices.count)] for _ in range(streams)
        ]

    def write(self, incident: Incident, outcome: int, units: dict[str, int]) -> None:
        """Enter an incident as it ended, or stands at the end of the run."""
        event = incident.event
        part = self._slices.of(incident.noticed)  # nan, if unnoticed, lies nowhere
        if part is not None:
            self._outcomes[incident.stream][part][outcome] += 1
            if event is not None:
                _sum_up(self._cells[incident.stream][part], incident.noticed, event)
        if self._rows is not None:
            self._rows.extend(_row(incident, event, outcome, units))

    def columns(self) -> dict[str, Floats | NDArray[np.int64]]:
        """Return the rows by column, in the order in which the events broke out."""
        table = np.frombuffer(self._rows or array("d"), dtype=np.float64)
        table = table.reshape(-1, len(COLUMNS))
        table = table[np.argsort(table[:, 0], kind="stable")]
        return {
            name: table[:, index].astype(np.int64) if name in WHOLE else table[:, index].copy()
            for index, name in enumerate(COLUMNS)
        }

    @property
    def cells(self) -> Floats:
        """Sums, shape `(streams, batches, CELL)`."""
        return np.array(self._cells, dtype=np.float64)

    @property
    def outcomes(self) -> NDArray[np.int64]:
        """Events by what has become of them, shape `(streams, batches, OUTCOMES)`."""
        return np.array(self._outcomes, dtype=np.int64)


def _sum_up(cell: list[float], since: float, event: Event) -> None:
    """Add one event's times to the sums; shared ones may have been served before they came."""
    times = event.times
    for index, name in enumerate(("assigned", "arrived", "confirmed", "closed")):
        time = times.get(name)
        if time is None:
            continue
        span = time - since
        if span < NO_WAIT_S:
            span = 0.0
        elif index == 0:
            cell[WAITED] += 1.0
        cell[COUNT + index] += 1.0
        cell[SUM + index] += span
        cell[SQUARES + index] += span * span


def _row(
    incident: Incident, event: Event | None, outcome: int, units: dict[str, int]
) -> tuple[float, ...]:
    columns = _known_of(incident)
    if event is None:
        return (*columns, *(_NAN,) * len(TIMES), outcome, -1, -1, 0, 0, 0, -1, incident.shared)
    get = event.times.get
    return (
        *columns,
        *(get(name, _NAN) for name in TIMES),
        outcome,
        units.get(event.responder or "", -1),
        units.get(event.actor or "", -1),
        event.attempts,
        event.preemptions,
        event.reports,
        event.number,
        incident.shared,
    )


@dataclass
class UnitRecord:
    """One responder over the measured time.

    Attributes:
        name: Name for people.
        kind: `guard` or `robot`.
        spent: Time by phase [s]: `ready`, `travel`, `look`, `act`, `stand by`, `return`.
        exposure: Time within danger radii by stage [s]: `approach`, `look`, `act`, `leave`.
        distance: Distance moved in the whole run [m].
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


@dataclass(kw_only=True)
class TimedRecording:
    """One run.

    Attributes:
        seed: Random seed.
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
        served: Number of events with a responder on site, integrated over each part.
        units: Each responder.
        operators: Time that each operator had an order [s].
        counters: Counters of the DVA; `refused ...`: its replies other than OK.
        violations: Rules found broken, by what; empty if all is well.
        events: Events of the world.
        messages: Number of messages that the DVA took.
        ended: End of the run [s].
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
        since = self.scenario.warm_up_s
        until = self.scenario.horizon_s
        detected = self.columns["detected"]
        return np.asarray((detected >= since) & (detected <= until))

    def count(self, *outcomes: str, stream: int | None = None) -> int:
        """Return events first reported within the measured time that ended so; none named: all."""
        codes = [CODES[o] for o in outcomes] or list(CODES.values())
        return int(self._of(self.outcomes, stream)[..., codes].sum())

    def total(self, measure: str, stream: int | None = None) -> tuple[float, float, float]:
        """Return the count, sum [s] and sum of squares [s^2] of one of `MEASURES`."""
        index = MEASURES.index(measure)
        cells = self._of(self.cells, stream).reshape(-1, self.cells.shape[-1]).sum(axis=0)
        return float(cells[COUNT + index]), float(cells[SUM + index]), float(cells[SQUARES + index])

    def mean(self, measure: str, stream: int | None = None) -> float:
        """Return the mean of one of `MEASURES` [s]; nan if there was none."""
        count, total, _ = self.total(measure, stream)
        return total / count if count else math.nan

    def waited(self, stream: int | None = None) -> float:
        """Return the share of attended events that had to wait for a responder."""
        count = self.total("wait", stream)[0]
        return float(self._of(self.cells, stream)[..., WAITED].sum()) / count if count else math.nan

    def utilisation(self, unit: int) -> float:
        """Return the share of the measured time that a responder had an order."""
        return self.units[unit].busy / self.duration

    @property
    def exposure(self) -> float:
        """Time of all guards within danger radii [s]."""
        return float(sum(sum(unit.exposure.values()) for unit in self.units))

    def _of(self, table: NDArray[Any], stream: int | None) -> NDArray[Any]:
        return table if stream is None else table[stream : stream + 1]
