"""What clients may ask for, read with suspicion: known words, numbers in range, nothing else."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from typing import Any

MOST_BYTES = 16 * 1024  # of a message or a body
MOST_ROBOTS = 64  # in one request
_ID = re.compile(r"[A-Za-z0-9._:-]{1,64}")
_NAME = re.compile(r"[A-Za-z0-9_.:/-]{1,200}")

Labels = Mapping[str, int]
Check = Callable[[Any, Labels], Any]


class BadMessage(ValueError):
    """What was asked for makes no sense; the message is one line for whoever asked."""


def read(text: str | bytes) -> dict[str, Any]:
    """A JSON object out of a message.

    Raises:
        BadMessage: it is something else.
    """
    try:
        data = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError):
        raise BadMessage("is not JSON") from None
    if not isinstance(data, dict):
        raise BadMessage("is not a JSON object")
    return data


def _no_number(word: str) -> float:
    raise ValueError(word)


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


_LINK = {
    "delay_s": number(0, 60),
    "jitter_s": number(0, 60),
    "loss": number(0, 1),
    "rate_bps": number(1, 1e12),
    "processing_s": number(0, 60),
}

# What may be asked: its arguments, and those of them that have to be there.
ACTIONS: dict[str, tuple[dict[str, Check], tuple[str, ...]]] = {
    "take": ({"robots": robots}, ("robots",)),
    "release": ({}, ()),
    "start": ({}, ()),
    "stop": ({}, ()),
    "emergency": ({"robots": robots_or_all}, ()),
    "link": (_LINK, ()),
    "pattern": ({"robot": robot, "name": word}, ("robot", "name")),
    "pace": ({"factor": number(0.01, 1000), "paused": flag}, ()),
    "confirm": ({}, ()),
    "refute": ({}, ()),
    "decline": ({}, ()),
    "tour": ({}, ()),
}
# Those that have no answer.
SILENT: dict[str, tuple[dict[str, Check], tuple[str, ...]]] = {
    "input": (
        {
            "n": whole(0, 2**53),
            "speed": number(0, 1),
            "turn": number(-1, 1),
            "held": flag,
        },
        ("n", "speed", "turn", "held"),
    ),
    "gone": ({}, ()),
}


def asked_of(name: Any, given: Any, labels: Labels, silent: bool = False) -> dict[str, Any]:
    """What the simulation is asked for.

    Args:
        name: Of the action.
        given: Its arguments.
        labels: Of the robots, with their indices.
        silent: Whether those without an answer may be asked for, too.

    Raises:
        BadMessage: no such action, or an argument that makes no sense.
    """
    known = ACTIONS | SILENT if silent else ACTIONS
    if not isinstance(name, str) or name not in known:
        raise BadMessage(f"no such action; there are: {', '.join(known)}")
    if not isinstance(given, dict):
        raise BadMessage(f"{name}: arguments should be an object")
    checks, needed = known[name]
    for key in needed:
        if key not in given:
            raise BadMessage(f"{name}: {key} is missing")
    asked = {"do": name}
    for key, value in given.items():
        if key not in checks:
            raise BadMessage(f"{name}: no such argument; there are: {', '.join(checks) or 'none'}")
        try:
            asked[key] = checks[key](value, labels)
        except BadMessage as error:
            raise BadMessage(f"{name}: {key} {error}") from None
    if name == "emergency":
        asked.setdefault("robots", "all")
    return asked


def id_of(value: Any) -> str:
    """The id by which a repeated request is known.

    Raises:
        BadMessage: it is none.
    """
    if not isinstance(value, str) or not _ID.fullmatch(value):
        raise BadMessage("id should be 1 to 64 letters, digits, dots, colons or hyphens")
    return value


class Bucket:
    """How often a client may say something.

    Args:
        rate: On average [1/s].
        burst: At once.
    """

    def __init__(self, rate: float, burst: int) -> None:
        self._rate, self._burst = rate, float(burst)
        self._room, self._then = float(burst), 0.0

    def takes(self, now: float) -> bool:
        """Whether another message at `now` [s] is within bounds."""
        self._room = min(self._burst, self._room + (now - self._then) * self._rate)
        self._then = now
        self._room -= 1.0
        return self._room >= 0.0
