"""What is kept of a run: a row for each event or sums for each batch, and integrals over time.

The integrals are summed up over time from how many events wait and are served; waits are taken
from the events' own times. So each checks the other (Little's law).
"""

from __future__ import annotations

import math
from array import array

import numpy as np
from numpy.typing import NDArray

from dva_sim.core.events import Event
from dva_sim.simulation.shift.demand import Incident

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
"""What has become of an event; a confirmed one may still be open where containment is needed."""

STEPS_IN_ORDER = ("detected", "assigned", "departed", "arrived", "confirmed", "contained", "closed")
CODES = {name: code for code, name in enumerate(OUTCOMES)}
MEASURES = ("wait", "response", "confirmation", "sojourn")
"""From the first report to the (last) assignment, arrival, confirmation and end [s]."""

WAITED, COUNT, SUM, SQUARES = 0, 1, 1 + len(MEASURES), 1 + 2 * len(MEASURES)
CELL = 1 + 3 * len(MEASURES)
AT_ONCE = 1e-9  # shorter waits are none [s]
_NAN = math.nan


class Slices:
    """The measured time, in parts of equal length.

    Args:
        start: [s]
        end: [s]
        count: How many parts.
    """

    def __init__(self, start: float, end: float, count: int) -> None:
        self.start, self.end, self.count = start, end, count
        self.width = (end - start) / count

    def of(self, time: float) -> int | None:
        """The part that a time [s] lies in; None outside."""
        if not self.start <= time <= self.end:
            return None
        return min(int((time - self.start) / self.width), self.count - 1)


class Level:
    """How many there are of something, integrated over the measured time.

    Attributes:
        now: How many there are.
        areas: Integral over each part [s].
    """

    __slots__ = ("_last", "_slices", "areas", "now")

    def __init__(self, slices: Slices) -> None:
        self.now = 0
        self.areas = [0.0] * slices.count
        self._slices, self._last = slices, 0.0

    def change(self, by: int, time: float) -> None:
        """There are more, or fewer, from `time` [s] on."""
        if self.now:
            self.advance(time)
        self._last = time
        self.now += by

    def advance(self, time: float) -> None:
        """Sum up to `time` [s]."""
        slices, since = self._slices, self._last
        self._last = time
        since, until = max(since, slices.start), min(time, slices.end)
        while since < until:
            part = min(int((since - slices.start) / slices.width), slices.count - 1)
            end = until
            if part < slices.count - 1:
                end = min(until, slices.start + (part + 1) * slices.width)
            if end <= since:  # the border itself, by rounding
                part, end = part + 1, min(until, slices.start + (part + 2) * slices.width)
            self.areas[part] += self.now * (end - since)
            since = end


class Ledger:
    """Rows or sums.

    Args:
        streams: How many streams.
        slices: Parts of the measured time.
        rows: Whether to keep a row for each event.
    """

    def __init__(self, streams: int, slices: Slices, rows: bool) -> None:
        self._slices, self._rows = slices, array("d") if rows else None
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
        """The rows by column, in the order in which the events broke out."""
        table = np.frombuffer(self._rows or array("d"), dtype=np.float64)
        table = table.reshape(-1, len(COLUMNS))
        table = table[np.argsort(table[:, 0], kind="stable")]
        return {
            name: table[:, place].astype(np.int64) if name in WHOLE else table[:, place].copy()
            for place, name in enumerate(COLUMNS)
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
    for place, name in enumerate(("assigned", "arrived", "confirmed", "closed")):
        time = times.get(name)
        if time is None:
            continue
        span = time - since
        if span < AT_ONCE:
            span = 0.0
        elif place == 0:
            cell[WAITED] += 1.0
        cell[COUNT + place] += 1.0
        cell[SUM + place] += span
        cell[SQUARES + place] += span * span


def _row(
    incident: Incident, event: Event | None, outcome: int, units: dict[str, int]
) -> tuple[float, ...]:
    place = incident.place
    known = (
        incident.number,
        incident.stream,
        incident.index,
        place.zone,
        place.x,
        place.y,
        incident.true,
        incident.severity,
        incident.occurred,
        incident.noticed,
    )
    if event is None:
        return (*known, *(_NAN,) * len(TIMES), outcome, -1, -1, 0, 0, 0, -1, incident.shared)
    get = event.times.get
    return (
        *known,
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
