"""Options of plug-ins from a configuration, checked before anything runs.

Each function takes an option's name and value. It returns the value, or raises an error that
names the valid values.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import Any

from dva_sim.kernel.errors import ConfigError


def number(
    name: str,
    value: Any,
    *,
    least: float = -math.inf,
    above: float = -math.inf,
    most: float = math.inf,
    below: float = math.inf,
) -> float:
    """Return a finite number within optional bounds.

    Raises:
        ConfigError: the value is not such a number.
    """
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    fits = is_number and least <= value <= most and above < value < below
    if not (fits and math.isfinite(value)):
        bounds = _range(least, above, most, below)
        raise _wrong(name, value, f"a number {bounds}".rstrip())
    return float(value)


def whole_number(name: str, value: Any, least: int, most: int) -> int:
    """Return a whole number within bounds.

    Raises:
        ConfigError: the value is not such a number.
    """
    if type(value) is not int or not least <= value <= most:
        raise _wrong(name, value, f"a whole number from {least} to {most}")
    return value


def one_of(name: str, value: Any, words: Collection[str]) -> str:
    """Return a value that is one of the allowed words.

    Raises:
        ConfigError: it is not one of them.
    """
    if not isinstance(value, str) or value not in words:
        raise _wrong(name, value, f"one of {', '.join(sorted(words))}")
    return value


def some_of(name: str, value: Any, allowed: Collection[str]) -> frozenset[str]:
    """Return a list of allowed words as a set.

    Raises:
        ConfigError: the value is not a list, or contains another word.
    """
    valid = f"a list of some of {', '.join(sorted(allowed))}"
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise _wrong(name, value, valid)
    words = list(value)
    if not all(isinstance(word, str) and word in allowed for word in words):
        raise _wrong(name, words, valid)
    return frozenset(words)


def _range(least: float, above: float, most: float, below: float) -> str:
    """Return bounds in words: `above 0`, `from 0 to 1`, `of at least 0, below 1`."""
    if math.isfinite(least) and math.isfinite(most):
        return f"from {least:g} to {most:g}"
    words = {"of at least": least, "above": above, "at most": most, "below": below}
    return ", ".join(f"{word} {bound:g}" for word, bound in words.items() if math.isfinite(bound))


def _wrong(name: str, value: Any, valid: str) -> ConfigError:
    return ConfigError(f"option {name!r} is {value!r}; should be {valid}")
