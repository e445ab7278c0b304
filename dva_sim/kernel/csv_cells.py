"""Cells of tables with commas, of which spreadsheets would take some for formulas."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, Final

ACTS: Final = r"^[=+\-@\t\r]"  # first characters that make a cell a formula


def harmless(cell: Any) -> Any:
    """Return a cell as it is, or, if it is text that would act, with an apostrophe before it."""
    return f"'{cell}" if isinstance(cell, str) and re.match(ACTS, cell) else cell


def harmless_row(cells: Iterable[Any]) -> list[Any]:
    """Return all cells of a row."""
    return [harmless(cell) for cell in cells]
