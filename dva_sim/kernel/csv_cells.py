"""Cells of CSV tables, protected from being taken for formulas by spreadsheets."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, Final

ACTS: Final = r"^[=+\-@\t\r]"  # first characters that make a cell a formula


def harmless(cell: Any) -> Any:
    """Return a cell, with an apostrophe before text that would act as a formula."""
    return f"'{cell}" if isinstance(cell, str) and re.match(ACTS, cell) else cell


def harmless_row(cells: Iterable[Any]) -> list[Any]:
    """Return all cells of a row."""
    return [harmless(cell) for cell in cells]
