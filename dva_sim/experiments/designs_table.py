"""The rows of a design in a CSV file: a header of factors, then a level in every cell."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator
from pathlib import Path

from dva_sim.config import MOST_VALUES, Document, Path_, parse_scalar, read_text
from dva_sim.errors import ConfigError
from dva_sim.experiments.asking import Level, refuse_keys_of_the_design

ROWS = "rows"
_CELL = re.compile(r'("(?:[^"]|"")*"|[^,]*)(?:,|$)')


def read_table(path: Path) -> Document:
    """The rows of a CSV file, under the key `rows`, with the place of every level.

    Levels are read as YAML would read them: `0.5` is a number, `true` is true, `null` is nothing.

    Raises:
        ConfigError: unreadable, a row of another length, an empty cell, a key twice.
    """
    lines = read_text(path).split("\n")
    places: dict[Path_, tuple[int, int]] = {}
    header: list[str] = []
    rows: list[dict[str, Level]] = []
    for number, line, cells in _cells(path, lines):
        starts = _starts(line)[: len(cells)]  # the pattern also finds the empty end
        if not header:
            header = _header(path, number, starts, cells)
            continue
        if len(cells) != len(header):
            problem = f"row should have {len(header)} cells as the header has, not {len(cells)}"
            raise ConfigError(problem, path, number, 1)
        if len(places) > MOST_VALUES:
            raise ConfigError(f"has more than {MOST_VALUES} values", path, number, 1)
        places[ROWS, len(rows)] = (number, 1)
        row: dict[str, Level] = {}
        for key, text, start in zip(header, cells, starts, strict=True):
            places[ROWS, len(rows), key] = (number, start)
            row[key] = _level(path, number, start, key, text)
        rows.append(row)
    if not rows:
        raise ConfigError("should have a header of factors, and rows of levels", path, 1, 1)
    return Document({ROWS: rows}, path, places)


def _cells(path: Path, lines: list[str]) -> Iterator[tuple[int, str, list[str]]]:
    """Number, text and cells of each line that is not blank; a cell does not go on to the next."""
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            (cells,) = csv.reader([line.rstrip("\r")], strict=True)
        except csv.Error as error:
            raise ConfigError(f"is not CSV: {error}", path, number, 1) from None
        yield number, line, cells


def _starts(line: str) -> list[int]:
    """Column, from 1, at which each cell of a line begins."""
    return [match.start() + 1 for match in _CELL.finditer(line)]


def _header(path: Path, number: int, starts: list[int], cells: list[str]) -> list[str]:
    keys = [cell.strip() for cell in cells]
    for index, (key, start) in enumerate(zip(keys, starts, strict=True)):
        if not key:
            raise ConfigError("a factor without a name", path, number, start)
        if key in keys[:index]:
            raise ConfigError(f"factor {key!r} stands twice", path, number, start)
        if ";" in key:
            raise ConfigError("cells are separated by commas, not by ;", path, number, start)
        try:
            refuse_keys_of_the_design([key])
        except ValueError as error:
            raise ConfigError(str(error), path, number, start) from None
    return keys


def _level(path: Path, line: int, column: int, key: str, text: str) -> Level:
    if not text.strip():
        raise ConfigError(f"no level of {key!r}; write null for none", path, line, column)
    try:
        level = parse_scalar(text.strip())
    except ConfigError as error:
        raise ConfigError(error.problem, path, line, column) from None
    if not isinstance(level, bool | int | float | str | None):
        raise ConfigError(f"{text.strip()!r} is not one level of {key!r}", path, line, column)
    if isinstance(level, float) and not math.isfinite(level):
        problem = f"level of {key!r} should be a finite number, not {level}"
        raise ConfigError(problem, path, line, column)
    return level
