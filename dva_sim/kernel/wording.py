"""Numbers, lists and sentences in words, as reports, tables and the terminal print them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from dva_sim.kernel.units import ending_of


def without_unit(name: str) -> str:
    """Return a key without its unit, with spaces between its words."""
    ending = ending_of(name)
    stem = name.removesuffix(f"_{ending}") if ending else name
    return stem.replace(".", " ").replace("_", " ")


def number(value: float) -> str:
    """Return a number with at most three significant figures."""
    if not math.isfinite(value):
        return "–"
    decimals = 0 if abs(value) >= 100 else 1 if abs(value) >= 1 else 2
    text = f"{value:.{decimals}f}"
    return text.replace("-", "\N{MINUS SIGN}") if float(text) else "0"


def as_number(text: str) -> float:
    """Parse the output of `number`; its dash is nan."""
    return float(text.replace("\N{MINUS SIGN}", "-").replace("–", "nan"))


def capital(text: str) -> str:
    """Return a text with a capital first letter, unless it begins with a name such as `min_eta`."""
    return text if "_" in text.partition(" ")[0] else text[:1].upper() + text[1:]


def quantity(value: float, unit: str) -> str:
    """Return a number with its unit, separated by a no-break space."""
    return f"{number(value)}\N{NO-BREAK SPACE}{unit}" if unit else number(value)


def signed(value: float, unit: str) -> str:
    """Return a difference with its sign, such as `+4.5 s`; zero has no sign."""
    return f"{'+' if value > 0 and number(value) != '0' else ''}{quantity(value, unit)}"


def percent(share: float) -> str:
    """Return a share as a whole percentage; small ones keep a decimal so as not to read zero."""
    if not math.isfinite(share):
        return "–"
    text = f"{100 * share:.0f}" if share == 0 or 0.01 <= share <= 0.99 else f"{100 * share:.1f}"
    return f"{text.removesuffix('.0')}\N{NO-BREAK SPACE}%"


def first_and_rest(text: str) -> tuple[str, str]:
    """Return the first sentence of a text, and the rest; an empty rest if there is none."""
    first, *further = re.split(r"(?<=[.]) (?=[A-Z])", text, maxsplit=1)
    return first, "".join(further)


def listing(words: Sequence[str], last: str = "and") -> str:
    """Return `a`, `a and b`, `a, b and c`."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"
