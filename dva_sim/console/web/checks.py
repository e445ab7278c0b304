"""What an argument of a client may be: known words, numbers in range, nothing else."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any

MOST_ROBOTS = 64  # in one request
_NAME = re.compile(r"[A-Za-z0-9_.:/-]{1,200}")

Labels = Mapping[str, int]
Check = Callable[[Any, Labels], Any]


class BadMessage(ValueError):
    """What was asked for makes no sense; the message is one line for whoever asked."""


class NotAllowed(BadMessage):
    """The asking token does not allow it."""


def number(low: float, high: float) -> Check:
    """A number within limits."""

    def check(value: Any, _: Labels) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise BadMessage(f"should be a number from {low:g} to {high:g}")
        if not low <= value <= high or not math.isfinite(value):
            raise BadMessage(f"should be a number from {low:g} to {high:g}")
        return value

    return check


def whole(low: int, high: int) -> Check:
    """A whole number within limits."""

    def check(value: Any, _: Labels) -> int:
        if type(value) is not int or not low <= value <= high:
            raise BadMessage(f"should be a whole number from {low} to {high}")
        return value

    return check


def flag(value: Any, _: Labels) -> bool:
    """Yes or no."""
    if not isinstance(value, bool):
        raise BadMessage("should be true or false")
    return value


def word(value: Any, _: Labels) -> str:
    """A name."""
    if not isinstance(value, str) or not _NAME.fullmatch(value):
        raise BadMessage("should be a name")
    return value


def text(least: int, most: int) -> Check:
    """Words of a person: in one line, of so many characters."""

    def check(value: Any, _: Labels) -> str:
        if not isinstance(value, str) or not least <= len(value) <= most:
            raise BadMessage(f"should be a text of {least} to {most} characters")
        if not all(letter.isprintable() for letter in value):
            raise BadMessage("should be a text in one line, without control characters")
        return value

    return check


def one_of(*words: Any) -> Check:
    """One of some values."""

    def check(value: Any, _: Labels) -> Any:
        if not any(type(value) is type(one) and value == one for one in words):
            raise BadMessage(f"should be one of: {', '.join(map(str, words))}")
        return value

    return check


def maybe(check: Check) -> Check:
    """What another check wants, or null."""
    return lambda value, labels: None if value is None else check(value, labels)


def several(check: Check, least: int, most: int) -> Check:
    """A list of so many of what another check wants."""

    def check_all(value: Any, labels: Labels) -> list[Any]:
        if not isinstance(value, list) or not least <= len(value) <= most:
            raise BadMessage(f"should be a list of {least} to {most}")
        return [check(one, labels) for one in value]

    return check_all


def robot(value: Any, labels: Labels) -> int:
    """A robot, by its index in the scene or by its label."""
    if isinstance(value, str) and value in labels:
        return labels[value]
    if type(value) is int and value in labels.values():
        return value
    raise BadMessage("should be a robot of this run")


def robots(value: Any, labels: Labels) -> list[int]:
    """Some robots."""
    if not isinstance(value, list) or len(value) > MOST_ROBOTS:
        raise BadMessage("should be a list of robots")
    return list(dict.fromkeys(robot(one, labels) for one in value))


def robots_or_all(value: Any, labels: Labels) -> list[int] | str:
    """Some robots, or `all`."""
    return "all" if value == "all" else robots(value, labels)
