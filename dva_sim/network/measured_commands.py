"""Commands that were measured over real middleware, from the table of a study."""

from __future__ import annotations

import csv
import gzip
import math
import re
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.read_once import read_once

_TIMES: Final = "made_s", "arrived_s"
_NUMBER: Final = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?|", re.IGNORECASE)
_OF_RUN: Final = "cell", "person", "trial"  # columns that tell the runs of a study apart


class SentCommand(NamedTuple):
    """A command of a run.

    Attributes:
        made: Time of sending [s], in the time of the run.
        arrived: Time at which the robot applied it [s]; nan if never.
    """

    made: float
    arrived: float


Run = tuple[SentCommand, ...]
_Runs = Mapping[tuple[str, ...], list[Run]]


def measured_runs(path: Path, where: Mapping[str, Any]) -> list[Run]:
    """Return the commands of each run, in the order of the file; a run may have none.

    Args:
        path: CSV table with the columns `made_s` and `arrived_s`, which may be compressed by gzip.
            A row without times stands for a run that found no connection.
        where: Values of other columns, of the rows that count.

    Raises:
        ConfigError: no row counts, or the file is not such a table.
    """
    try:
        groups = _grouped(path, tuple(where))
    except (OSError, EOFError, UnicodeError, csv.Error, zlib.error) as error:
        raise ConfigError(f"cannot be read as a table: {error}", path) from None
    except ValueError as error:
        raise ConfigError(f"times should be numbers: {error}", path) from None
    runs = groups.get(tuple(map(str, where.values())))
    if runs is None:
        condition = ", ".join(f"{key} {value}" for key, value in where.items()) or "the file"
        raise ConfigError(f"of {condition}, no command was measured", path)
    return runs


@read_once(lambda path: [path], most=2)
def _grouped(path: Path, keys: tuple[str, ...]) -> _Runs:
    """Return the runs by values of columns; one table serves thousands of drives, read once.

    Args:
        path: The table.
        keys: Columns to group by.
    """
    groups: dict[tuple[str, ...], dict[tuple[str | None, ...], list[SentCommand]]] = {}
    labels: dict[tuple[str, ...], dict[str, str]] = {}
    opened = gzip.open if path.suffix == ".gz" else open
    with opened(path, "rt", encoding="utf-8", newline="") as lines:
        for row in _rows(csv.reader(lines), {*_TIMES, *keys}, path):
            values = tuple(row[key] for key in keys)
            _refuse_mixture(labels.setdefault(values, _labels(row)), row, path)
            runs = groups.setdefault(values, {})
            run = runs.setdefault(tuple(row.get(key) for key in _OF_RUN), [])
            if row["made_s"]:
                run.append(_command(row, path))
    return {values: [tuple(run) for run in runs.values()] for values, runs in groups.items()}


def _labels(row: Mapping[str, str]) -> dict[str, str]:
    """Return the columns that tell which middleware, link or cell a command belongs to."""
    return {
        key: value for key, value in row.items() if key == "cell" or not _NUMBER.fullmatch(value)
    }


def _refuse_mixture(labels: Mapping[str, str], row: Mapping[str, str], path: Path) -> None:
    """Refuse commands of several middlewares or links as if they were of one."""
    for key, value in labels.items():
        if row[key] != value and key not in _TIMES:
            problem = f"mixes commands of {key} {value} and {row[key]}; choose one with `where`"
            raise ConfigError(problem, path)


def _command(row: Mapping[str, str], path: Path) -> SentCommand:
    made = float(row["made_s"])
    arrived = float(row["arrived_s"] or math.nan)
    if not math.isfinite(made) or math.isinf(arrived):
        raise ConfigError("times should be finite; leave the cell of a lost command empty", path)
    if arrived < made:
        problem = f"a command sent at {made:g} s arrived earlier, at {arrived:g} s"
        raise ConfigError(f"{problem}; do the two clocks differ?", path)
    return SentCommand(made, arrived)


def _rows(table: Any, needed: set[str], path: Path) -> Iterator[dict[str, str]]:
    head: list[str] = next(table, [])
    if missing := needed - set(head):
        raise ConfigError(f"has no column {', '.join(sorted(missing))}", path)
    for cells in filter(None, table):
        if len(cells) != len(head):
            problem = f"has {len(cells)} cells in a row, for {len(head)} columns"
            raise ConfigError(problem, path, table.line_num)
        yield dict(zip(head, cells, strict=True))
