"""Options of policies: what a configuration gives, made sure of before anything runs."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import Any

from dva_sim.kernel.errors import ConfigError


def at_least(name: str, value: Any, bound: float) -> float:
    """A finite number not below a bound.

    Raises:
        ConfigError: it is not.
    """
    return _number(name, value, f"a number of at least {bound:g}", bound, exclusive=False)


def above(name: str, value: Any, bound: float) -> float:
    """A finite number above a bound.

    Raises:
        ConfigError: it is not.
    """
    return _number(name, value, f"a number above {bound:g}", bound, exclusive=True)


def one_of(name: str, value: Any, known: Collection[str]) -> str:
    """One of some words.

    Raises:
        ConfigError: it is not.
    """
    if not isinstance(value, str) or value not in known:
        raise _wrong(name, value, f"one of {', '.join(sorted(known))}")
    return value


def some_of(name: str, value: Any, known: Collection[str]) -> frozenset[str]:
    """Any number of some words.

    Raises:
        ConfigError: not a list, or another word.
    """
    wanted = f"a list of some of {', '.join(sorted(known))}"
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise _wrong(name, value, wanted)
    words = list(value)
    if not all(isinstance(word, str) and word in known for word in words):
        raise _wrong(name, words, wanted)
    return frozenset(words)


def _number(name: str, value: Any, wanted: str, bound: float, exclusive: bool) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(name, value, wanted)
    if not math.isfinite(value) or value < bound or (exclusive and value == bound):
        raise _wrong(name, value, wanted)
    return float(value)


def _wrong(name: str, value: Any, wanted: str) -> ConfigError:
    return ConfigError(f"option {name!r} is {value!r}; should be {wanted}")
