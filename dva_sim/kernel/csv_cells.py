"""Cells of CSV tables, in which nothing acts: no formula, and no character that hides or turns."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, Final

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
