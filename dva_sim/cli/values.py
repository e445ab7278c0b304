"""Numbers on the command line, and what is said of words that are none of those wanted."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import typer

MOST_SEED = 2**63 - 1
_NUMBER = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)(e[+-]?[0-9]+)?", re.IGNORECASE)


def whole(least: int = 0, most: int = MOST_SEED) -> Callable[[int | str], int]:
    """Reads whole numbers from `least` to `most`."""

    def read(text: int | str) -> int:
        written = str(text)
        if re.fullmatch(r"[+-]?[0-9]{1,19}", written) and least <= int(written) <= most:
            return int(written)
        raise typer.BadParameter(f"{written!r} should be a whole number {_within(least, most)}")

    return read


def number(above: float = 0.0) -> Callable[[float | str], float]:
    """Reads numbers above `above`."""

    def read(text: float | str) -> float:
        value = float(text) if _NUMBER.fullmatch(str(text)) else math.nan
        if math.isfinite(value) and value > above:
            return value
        raise typer.BadParameter(f"{str(text)!r} should be a number above {above:g}")

    return read


def _within(least: int, most: int) -> str:
    return f"of at least {least}" if most == MOST_SEED else f"from {least} to {most}"
