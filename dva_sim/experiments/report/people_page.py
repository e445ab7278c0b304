"""The page of a run in which people drove: their drives, one by one; nothing is tested.

Without a contrast, and with only one run, actions of people are shown by person, messaging
pattern and link, and never averaged over them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.answer import Answer, Finding
from dva_sim.experiments.analysis.run_grid import RunGrid, Table
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.model_page import ModelPage
from dva_sim.kernel.wording import number, quantity
from dva_sim.simulation.labels import level_name

_KEYS = "person_label", "pattern", "link_delay_s"
_HEADS = (
    *("person", "messaging pattern", "one-way delay", "drives", "driven [s]"),
    *("age of commands, median [s]", "worst 5 % older than [s]", "without a command [%]"),
    *("refused", "time-outs", "times in the tour [s]"),
)


def people_drove(drives: Mapping[str, NDArray[Any]]) -> bool:
    """Return True if a person made at least one of the drives."""
    return "person_label" in drives and any(drives["person_label"].tolist())


class PeoplePage(ModelPage):
    """The page of a run in which people drove.

    Args:
        drives: Columns of the table `drives`.
    """

    name: ClassVar[str] = "people"
    cluster: ClassVar[str] = "run"
    has_support: ClassVar[bool] = False

    def __init__(self, view: StudyView, drives: Table) -> None:
        super().__init__(view)
        theirs = np.array([bool(label) for label in drives["person_label"].tolist()])
        self._drives = {name: np.asarray(column)[theirs] for name, column in drives.items()}

    def answer(self, finding: Finding | None) -> Answer:
        """Count people, drives and robots, and say that this is not an experiment."""
        drives = len(self._drives["person_label"])
        people = len(set(self._drives["person_label"].tolist()))
        robots = len(set(self._drives["robot_name"].tolist()))
        patterns = list(dict.fromkeys(self._drives["pattern"].tolist()))
        under = " and ".join(level_name("pattern", pattern) for pattern in patterns)
        return Answer(
            f"People drove: {_counted(people, 'person', 'people')} made "
            f"{_counted(drives, 'drive', 'drives')} of {_counted(robots, 'robot', 'robots')} "
            f"under {under}. It is a record of what they did, not an experiment: nothing is "
            "averaged over people, patterns or links, and nothing is compared."
        )

    def cells(self, part: RunGrid) -> CellTable | None:
        """The drives by person, pattern and link, in the order in which they began."""
        columns = [self._drives[key].tolist() for key in _KEYS if key in self._drives]
        keys = [tuple(map(str, key)) for key in zip(*columns, strict=True)]
        rows = []
        for key in dict.fromkeys(keys):
            here = np.array([each == key for each in keys])
            rows.append(self._row({name: c[here] for name, c in self._drives.items()}))
        return CellTable(part.name, list(_HEADS), 3, rows)

    def method(self, correlation: float | None) -> list[str] | None:
        """Explain the columns."""
        return [
            "Ages and time-outs are measured by the run's clock, command by command: the tables "
            "drives and commands have all of them. Nobody's name is kept."
        ]

    def _row(self, drives: Mapping[str, NDArray[Any]]) -> list[str]:
        delay = float(drives["link_delay_s"][0]) if "link_delay_s" in drives else np.nan
        lasted = np.asarray(drives["driven_s"], float)
        stopped = np.nansum(np.asarray(drives["stop_share"], float) * lasted)
        total = float(np.nansum(lasted))
        tour = np.asarray(drives.get("tour_time_s", []), float)
        return [
            str(drives["person_label"][0]),
            level_name("pattern", str(drives["pattern"][0])),
            "not known" if np.isnan(delay) else quantity(delay, "s"),
            str(len(lasted)),
            number(total),
            _median(drives["command_age_p50_s"]),
            _median(drives["command_age_p95_s"]),
            f"{100 * stopped / total:.0f}" if total else "–",
            str(int(np.nansum(np.asarray(drives["commands_refused"], float)))),
            str(int(np.nansum(np.asarray(drives["timeouts"], float)))),
            ", ".join(f"{time:.1f}" for time in tour[np.isfinite(tour)]) or "–",
        ]


def _median(values: NDArray[Any]) -> str:
    known = np.asarray(values, float)
    return number(float(np.nanmedian(known))) if np.isfinite(known).any() else "–"


def _counted(count: int, one: str, many: str) -> str:
    return f"{count} {one if count == 1 else many}"
