"""The page of a run in which people took part: they drove, or decided on events."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.answer import Answer, Finding
from dva_sim.experiments.analysis.run_grid import RunGrid, Table
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.model_page import ModelPage
from dva_sim.experiments.report.prose import sentence
from dva_sim.kernel.wording import number, quantity
from dva_sim.simulation.labels import level_name

_KEYS: Final = "person_label", "robot_name", "pattern", "link_delay_s"
_HEADS: Final = (
    *("person", "robot", "messaging pattern", "one-way delay", "drives", "driven [s]", "contacts"),
    *("age of commands, median [s]", "worst 5 % older than [s]", "without a command [%]"),
    *("refused", "time-outs", "times in the tour [s]"),
)
_DONE: Final = (
    ("acknowledged_by", "acknowledge_s", "acknowledged", "to acknowledge, median [s]"),
    ("decided_by", "decide_s", "decided", "to decide, median [s]"),
    ("sent_by", "send_s", "sent somebody", "to send, median [s]"),
)
_EVENT_HEADS: Final = (
    *("event", "kind", "room", "raised by", "acknowledged by", "after [s]", "decided by"),
    *("after [s]", "sent", "after [s]", "on the spot after [s]", "ended"),
)
DRIVES: Final = "Drives by person, robot, messaging pattern and link"
DECISIONS: Final = "Decisions by person"
EVENTS: Final = "Events, and how they ended"
PERSON: Final = "person-"  # a person's label begins so, the policy's does not


def people_drove(drives: Mapping[str, NDArray[Any]]) -> bool:
    """Return True if a person made at least one of the drives."""
    return "person_label" in drives and any(drives["person_label"].tolist())


class PeoplePage(ModelPage):
    """The page of a run in which people took part.

    Args:
        drives: Columns of the table `drives`; empty if nobody drove.
        reported: Columns of the table `reported`; empty without events, or before there was one.
    """

    name: ClassVar[str] = "people"
    cluster: ClassVar[str] = "run"
    has_support: ClassVar[bool] = False

    def __init__(self, view: StudyView, drives: Table, reported: Table) -> None:
        super().__init__(view)
        labels = drives["person_label"].tolist() if drives else []
        theirs = np.array([bool(label) for label in labels], bool)
        self._drives = {name: np.asarray(column)[theirs] for name, column in drives.items()}
        self._reported = _rows_of(reported)

    def answer(self, finding: Finding | None) -> Answer:
        """Count people, drives and events, and say that this is not an experiment."""
        drivers = self._column("person_label")
        deciders = {row[by] for row in self._reported for by, *_ in _DONE if _is_person(row[by])}
        patterns = [
            level_name("pattern", pattern) for pattern in dict.fromkeys(self._column("pattern"))
        ]
        endings = Counter(str(row["ended"]) for row in self._reported)
        return Answer(
            sentence(
                "people_drove",
                drives=len(drivers),
                people=len(set(drivers)),
                robots=len(set(self._column("robot_name"))),
                patterns=[level_name("pattern", pattern) for pattern in patterns],
                deciders=len(deciders),
                events=len(self._reported),
                endings=[f"{count} {ending}" for ending, count in sorted(endings.items())],
            )
        )

    def _column(self, name: str) -> list[Any]:
        return self._drives[name].tolist() if self._drives else []

    def cells(self, part: RunGrid) -> CellTable | None:
        """Return the drives by person, robot, pattern and link, in the order of their starts."""
        columns = [self._drives[key].tolist() for key in _KEYS if key in self._drives]
        keys = [tuple(map(str, key)) for key in zip(*columns, strict=True)]
        rows = []
        for key in dict.fromkeys(keys):
            here = np.array([each == key for each in keys])
            rows.append(self._row({name: c[here] for name, c in self._drives.items()}))
        return CellTable(DRIVES, list(_HEADS), 4, rows)

    def beside(self) -> list[CellTable]:
        """Return who decided on events and how fast, and all events with how they ended."""
        people = {row[by] for row in self._reported for by, *_ in _DONE if _is_person(row[by])}
        heads = ["person", *(head for *_, count, time in _DONE for head in (count, time))]
        rows = [[person, *self._done_by(person)] for person in sorted(people)]
        events = [[*_event(row)] for row in self._reported]
        return [
            CellTable(DECISIONS, heads, 1, rows),
            CellTable(EVENTS, list(_EVENT_HEADS), 3, events),
        ]

    def _done_by(self, person: str) -> Iterator[str]:
        for by, time, *_ in _DONE:
            times = np.array([row[time] for row in self._reported if row[by] == person], float)
            yield str(len(times))
            yield _median(times)

    def method(self, correlation: float | None) -> list[str] | None:
        """Explain the columns."""
        return [
            "Ages and time-outs are measured by the run's clock, command by command: the tables "
            "drives and commands have all of them. Nobody's name is kept.",
            "Times to acknowledge, decide and send count from the first report of an event: the "
            "table reported has them one by one, for raised events, too.",
        ]

    def _row(self, drives: Mapping[str, NDArray[Any]]) -> list[str]:
        delay = float(drives["link_delay_s"][0]) if "link_delay_s" in drives else np.nan
        lasted = np.asarray(drives["driven_s"], float)
        stopped = np.nansum(np.asarray(drives["stop_share"], float) * lasted)
        total = float(np.nansum(lasted))
        tour = np.asarray(drives.get("tour_time_s", []), float)
        contacts = np.asarray(drives.get("contacts", []), float)
        return [
            str(drives["person_label"][0]),
            str(drives["robot_name"][0]),
            level_name("pattern", str(drives["pattern"][0])),
            "not known" if np.isnan(delay) else quantity(delay, "s"),
            str(len(lasted)),
            number(total),
            str(int(np.nansum(contacts))) if np.isfinite(contacts).any() else "–",
            _median(drives["command_age_p50_s"]),
            _median(drives["command_age_p95_s"]),
            f"{100 * stopped / total:.0f}" if total else "–",
            str(int(np.nansum(np.asarray(drives["commands_refused"], float)))),
            str(int(np.nansum(np.asarray(drives["timeouts"], float)))),
            ", ".join(f"{time:.1f}" for time in tour[np.isfinite(tour)]) or "–",
        ]


def _is_person(label: str) -> bool:
    return label.startswith(PERSON)


def _rows_of(table: Table) -> list[dict[str, Any]]:
    columns = {name: np.asarray(column).tolist() for name, column in table.items()}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _event(row: Mapping[str, Any]) -> Iterator[str]:
    """Yield the cells of one event."""
    yield str(int(row["event_id"]))
    yield str(row["kind"]).replace("_", " ")
    yield row["room"] or "–"
    for name in ("raised_by", "acknowledged_by"):
        yield row[name] or "–"
    yield _median(row["acknowledge_s"])
    yield row["decided_by"] or "–"
    yield _median(row["decide_s"])
    yield f"{row['sent']} by {row['sent_by']}" if row["sent"] else "–"
    yield _median(row["send_s"])
    yield _median(float(row["t_arrived_s"] or np.nan) - row["t_reported_s"])
    yield row["ended"]


def _median(values: Any) -> str:
    numbers = np.asarray(values, float)
    return number(float(np.nanmedian(numbers))) if np.isfinite(numbers).any() else "–"
