"""CSV files as saved by spreadsheets and other programs.

Cells are separated by commas, semicolons or tabs; unless commas separate them, numbers may have a
decimal comma. Blank lines are ignored, and every mistake has its line and column.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from dva_sim.kernel.csv_cells import numbered_rows
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.read_once import read_once
from dva_sim.kernel.yaml_files import read_text

_POINT = re.compile(r"[-+]?\d+\.\d+")
_COMMA = re.compile(r"(?:^|[;\t])[\s\"]*[-+]?\d+,\d+[\s\"]*(?:$|[;\t])")


@dataclass(frozen=True, slots=True)
class Cell:
    """A row of a table, or one cell of it."""

    table: CsvTable
    line: int
    row: Sequence[str]
    place: int = 0

    @property
    def text(self) -> str:
        """Content of the cell."""
        return self.row[self.place].strip()

    def at(self, column: int) -> Cell:
        """Return the cell of the row at a column."""
        return Cell(self.table, self.line, self.row, column)

    @property
    def decimal(self) -> str:
        """Content of the cell with a decimal point.

        Raises:
            ConfigError: it has a point in a table with decimal commas, where 1.060 may mean 1060.
        """
        if not self.table.has_commas:
            return self.text
        if _POINT.fullmatch(self.text):
            raise self.error(f"{self.text!r} has a point, other numbers a decimal comma: write one")
        return self.text.replace(",", ".")

    def number(self, what: str) -> float:
        """Return the content as a finite number.

        Raises:
            ConfigError: it is not a number; the message names it by `what`.
        """
        try:
            value = float(self.decimal)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            name = self.table.names[self.place]
            raise self.error(f"{name} should be {what}, not {self.text[:40]!r}")
        return value

    def error(self, problem: str) -> ConfigError:
        """Return a mistake at this cell."""
        column = 1 + sum(len(cell) + 1 for cell in self.row[: self.place])
        return ConfigError(problem, self.table.file, self.line, column)


@dataclass(frozen=True, slots=True)
class CsvTable:
    """A table with a header.

    Attributes:
        file: File that it was read from.
        names: Names of the columns, from the header.
        rows: Line number and cells of each row; as many cells as names.
        line: Line number of the header.
        has_commas: True if numbers have a decimal comma.
    """

    file: Path
    names: tuple[str, ...]
    rows: list[tuple[int, list[str]]]
    line: int
    has_commas: bool

    def cells(self) -> Iterator[Cell]:
        """Yield the first cell of each row."""
        for line, row in self.rows:
            yield Cell(self, line, row)

    def error(self, problem: str, column: int) -> ConfigError:
        """Return a mistake at a name of the header."""
        return Cell(self, self.line, self.names, column).error(problem)


@read_once(lambda path: [Path(path)])
def read_table(path: str) -> CsvTable:
    """Read a table, without checking its cells.

    Raises:
        ConfigError: it cannot be read, is not UTF-8, has no header, or a row has more or fewer
            cells than the header.
    """
    file = Path(path)
    try:
        text = read_text(file)
    except ConfigError as error:
        if error.line is None:
            raise
        problem = f"{error.problem}: save it as UTF-8"
        raise ConfigError(problem, file, error.line, error.column) from None
    head = next((line for line in text.split("\n") if line.strip()), "")
    delimiter = max(",;\t", key=head.count)
    table = numbered_rows(text.split("\n"), file, delimiter)
    rows = [(line, row) for line, row in table if any(cell.strip() for cell in row)]
    if not rows:
        raise ConfigError("is empty: it needs a header with the names of its columns", file, 1, 1)
    line, names = rows[0]
    for number, row in rows[1:]:
        if len(row) != len(names):
            cells = "1 cell" if len(row) == 1 else f"{len(row)} cells"
            fault = f"has {cells}, and the header {len(names)}"
            problem = f"{fault}: fill in, or quote a cell that holds {delimiter!r}"
            raise ConfigError(problem, file, number, 1)
    has_commas = delimiter != "," and any(_COMMA.search(line) for line in text.split("\n"))
    return CsvTable(file, tuple(name.strip() for name in names), rows[1:], line, has_commas)
