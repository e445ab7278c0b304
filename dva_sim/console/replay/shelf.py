"""The recordings of a results folder, the worst run first, with what was measured of each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dva_sim.console.wire.records import ShelfEntry, ShelfLine
from dva_sim.experiments.execution.kept_recordings import FOLDER, badness, rows_of
from dva_sim.experiments.report.report import PAGE
from dva_sim.experiments.results.results import MANIFEST, Results
from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.writing import SUFFIX
from dva_sim.simulation.labels import factor_name, measure_called

Row = Mapping[str, Any]
MAX_RECORDINGS = 2000  # recordings in the list
MAX_MEASURES = 4  # beside the one that answers the study
SHOWN = ("drive_time_s", "confirmation_s", "response_s", "command_age_p95_ms", "collisions")


@dataclass(frozen=True)
class _Kept:
    """A recording, and the row of its run if the tables have it."""

    path: Path
    row: Row | None


class Shelf:
    """The recordings below a folder.

    Args:
        folder: Results folder of a study, or any folder with recordings.

    Attributes:
        report: The study's report; None without one.

    Raises:
        ConfigError: no such folder, or no recording in it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        results = Results.load(folder) if (folder / MANIFEST).exists() else None
        where = folder / FOLDER if (folder / FOLDER).is_dir() else folder
        paths = sorted(where.glob(f"*{SUFFIX}"))[:MAX_RECORDINGS]
        if not paths:
            hint = "; a study keeps some with `record: worst`" if results is not None else ""
            raise ConfigError(f"contains no recordings{hint}", folder)
        page = folder / PAGE
        self.report = page if page.is_file() else None
        rows = {} if results is None else _rows_by_name(results)
        recordings = [_Kept(path, rows.get(path.name)) for path in paths]
        self._answer = _answer_of(results)
        self._measures = _measures_of(self._answer, rows)
        self._factors = [] if results is None else list(results.factors)
        self._question = "" if results is None else str(results.study.get("question", ""))
        if self._answer:
            recordings.sort(key=lambda one: -_worst_first(self._answer, one.row))
        self._kept = {one.path.name: one for one in recordings}

    def find(self, name: str) -> Path:
        """Return the recording of that name.

        Raises:
            ConfigError: there is none here.
        """
        if name not in self._kept:
            raise ConfigError(f"there is no recording {name!r} here", self.folder)
        return self._kept[name].path

    def line(self) -> ShelfLine:
        """Return what pages show of it."""
        measures = [measure_called(name) for name in self._measures]
        return {
            "k": "shelf",
            "folder": self.folder.name,
            "question": self._question,
            "report": self.report is not None,
            "factors": [factor_name(factor) for factor in self._factors],
            "measures": [{"title": m.words, "unit": m.unit} for m in measures],
            "worst_by": measure_called(self._answer).words if self._answer else "",
            "recordings": [self._entry(one) for one in self._kept.values()],
        }

    def _entry(self, one: _Kept) -> ShelfEntry:
        row = one.row or {}
        return {
            "name": one.path.name,
            "bytes": one.path.stat().st_size,
            "part": row.get("part", ""),
            "person": row.get("person"),
            "trial": row.get("trial"),
            "levels": [_plain(row.get(factor)) for factor in self._factors],
            "values": [_plain(row.get(name)) for name in self._measures],
        }


def _rows_by_name(results: Results) -> dict[str, Row]:
    """Return the runs of a study by the names that their recordings have."""
    return {f"{address}{SUFFIX}": row for address, row in rows_of(results).items()}


def _answer_of(results: Results | None) -> str:
    """Return the measure by which a study is answered; empty without one."""
    answer = None if results is None else results.study.get("answer")
    return str(answer["measure"]) if isinstance(answer, dict) else ""


def _measures_of(answer: str, rows: Mapping[str, Row]) -> list[str]:
    """Return those that are shown: the one that answers, and usual ones that the tables have."""
    row = next(iter(rows.values()), None)
    if row is None:
        return []
    usual = [name for name in SHOWN if name in row and name != answer]
    return [*([answer] if answer in row else []), *usual[:MAX_MEASURES]]


def _worst_first(answer: str, row: Row | None) -> float:
    return -math.inf if row is None else badness(answer, row)


def _plain(value: Any) -> Any:
    """Convert a value for JSON: missing becomes null."""
    if isinstance(value, float):
        return round(value, 3) if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)
