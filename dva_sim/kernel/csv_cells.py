"""Cells of CSV tables, in which nothing acts: no formula, and no character that hides or turns."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.labels import HIDDEN

ACTS: Final = r"^[=+\-@\t\r]"  # first characters by which spreadsheets recognise a formula
HIDES: Final = "[" + "".join(map(chr, sorted(HIDDEN)[1:])) + "]"  # but for NUL, which ends SQL
SHOWN: Final = "\ufffd"  # in the place of each character that hides


def harmless(cell: Any) -> Any:
    """Return a cell, with an apostrophe before text that would act as a formula."""
    if not isinstance(cell, str):
        return cell
    text = re.sub(HIDES, SHOWN, cell.replace("\0", SHOWN))
    return f"'{text}" if re.match(ACTS, text) else text


def harmless_row(cells: Iterable[Any]) -> list[Any]:
    """Return all cells of a row."""
    return [harmless(cell) for cell in cells]


def numbered_rows(
    lines: Iterable[str], path: Path, delimiter: str = ","
) -> Iterator[tuple[int, list[str]]]:
    """Yield each row of a table, with the number of its first line; lines without cells, too.

    Raises:
        ConfigError: it is not a table, with the line.
    """
    reader = csv.reader(lines, delimiter=delimiter)
    line = 1
    try:
        for row in reader:
            yield line, row
            line = reader.line_num + 1
    except csv.Error as error:
        raise ConfigError(f"is not a table: {error}", path, line, 1) from None
