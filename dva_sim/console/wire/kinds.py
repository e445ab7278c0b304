"""Kinds of arguments: limits that pydantic checks, and the words of an error.

    delay_s: Annotated[float, Number(0, 5)]

Declaring them costs a process nothing of pydantic, which is loaded when something is checked.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import (
    Annotated,
    Any,
    Literal,
    NotRequired,
    TypeAlias,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

MAX_ROBOTS = 64  # in one request
Labels: TypeAlias = Mapping[str, int]


class BadMessage(ValueError):
    """A request makes no sense; the message is one line for its sender."""


class Kind:
    """Limits of a value.

    Args:
        words: Description of valid values.
        limits: Limits by the names of pydantic's core, such as `ge` and `max_length`.
    """

    def __init__(self, words: str, **limits: Any) -> None:
        self.words = words
        self._limits = limits

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> dict[str, Any]:
        return {**handler(source), **self._limits}


class Number(Kind):
    """A number within limits."""

    def __init__(self, low: float, high: float) -> None:
        super().__init__(f"a number from {low:g} to {high:g}", ge=low, le=high, allow_inf_nan=False)


class Whole(Kind):
    """A whole number within limits."""

    def __init__(self, low: int, high: int) -> None:
        super().__init__(f"a whole number from {low} to {high}", ge=low, le=high)


class Several(Kind):
    """A list of so many elements."""

    def __init__(self, least: int, most: int) -> None:
        super().__init__(f"a list of {least} to {most}", min_length=least, max_length=most)


class Text(Kind):
    """A person's words: in one line, of so many characters."""

    def __init__(self, least: int, most: int) -> None:
        super().__init__(
            f"a text of {least} to {most} characters",
            min_length=least,
            max_length=most,
            pattern=r"^(?:[^\p{C}\p{Z}]| )*$",
        )


class _Function(Kind):
    """A value that a function of this module reads."""

    def __init__(self, words: str, read: Any) -> None:
        super().__init__(words)
        self._read = read

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> dict[str, Any]:
        function = {"type": "with-info", "function": self._read}
        return {"type": "function-plain", "function": function}


def _robot(value: Any, info: Any) -> int | str:
    """Return the index of a robot in the scene; without labels, what it was called by."""
    labels: Labels | None = info.context
    if isinstance(value, str) and (labels is None or value in labels):
        return value if labels is None else labels[value]
    if type(value) is int and (labels is None or value in labels.values()):
        return value
    raise ValueError("should be a robot of this run")


def _robots(value: Any, info: Any) -> list[int | str]:
    if not isinstance(value, list) or len(value) > MAX_ROBOTS:
        raise ValueError("should be a list of robots")
    return list(dict.fromkeys(_robot(one, info) for one in value))


def _robots_or_all(value: Any, info: Any) -> list[int | str] | str:
    return "all" if value == "all" else _robots(value, info)


Share = Annotated[float, Number(0, 1)]
Name = Annotated[str, Kind("a name", pattern=r"^[A-Za-z0-9_.:/-]{1,200}$")]
Label = Annotated[str, Text(1, 64)]
Reason = Annotated[str, Text(0, 256)]
Robot = Annotated[int | str, _Function("a robot, by its label or its number", _robot)]
Robots = Annotated[list[int | str], _Function("a list of robots", _robots)]
RobotsOrAll = Annotated[
    list[int | str] | Literal["all"], _Function('a list of robots, or "all"', _robots_or_all)
]


def words_of(hint: Any) -> str:
    """Describe what a value of an annotation should be."""
    if get_origin(hint) is Annotated:
        kinds = [one for one in hint.__metadata__ if isinstance(one, Kind)]
        return kinds[0].words if kinds else words_of(get_args(hint)[0])
    if get_origin(hint) is Literal:
        return f"one of: {', '.join(map(str, get_args(hint)))}"
    if get_origin(hint) in _UNIONS:
        return f"{words_of(get_args(hint)[0])}, or null"
    return "true or false" if hint is bool else "a text" if hint is str else "an object"


_UNIONS = (Union, type(int | str))


def _inner(hint: Any) -> Any:
    """Return the annotation of the elements of a list."""
    if get_origin(hint) is Annotated or get_origin(hint) in _UNIONS:
        return _inner(get_args(hint)[0])
    return get_args(hint)[0] if get_origin(hint) is list else hint


@cache
def hints_of(arguments: type) -> dict[str, Any]:
    """Return the annotations of a class of arguments, by their names."""
    hints = get_type_hints(arguments, include_extras=True).items()
    return {key: get_args(h)[0] if get_origin(h) is NotRequired else h for key, h in hints}


@cache
def adapter_of(arguments: type) -> Any:
    """Return the validator of a class of arguments; pydantic is loaded with the first."""
    from pydantic import TypeAdapter, with_config  # late: start-up

    return TypeAdapter(with_config(strict=True, extra="forbid")(arguments))


def read_arguments(arguments: type, values: Any, labels: Labels | None = None) -> dict[str, Any]:
    """Check arguments against their declaration; those that were given, as they are meant.

    Args:
        arguments: A `TypedDict` whose annotations are of this module.
        values: From a client.
        labels: Labels of the robots, with their indices; None accepts any label.

    Raises:
        BadMessage: one is missing, unknown, or not of its kind.
    """
    from pydantic import ValidationError  # late: start-up

    if not isinstance(values, dict):
        raise BadMessage("arguments should be an object")
    try:
        read: dict[str, Any] = adapter_of(arguments).validate_python(values, context=labels)
    except ValidationError as error:
        errors = error.errors(include_url=False, include_input=False)
        first = min(errors, key=lambda one: one["type"] != "missing")
        raise BadMessage(_problem(arguments, first)) from None
    return read


def _problem(arguments: type, error: Mapping[str, Any]) -> str:
    hints = hints_of(arguments)
    (key, *path) = error["loc"]
    if error["type"] == "missing":
        return f"{key} is missing"
    if error["type"] == "extra_forbidden":
        return f"no such argument; there are: {', '.join(hints) or 'none'}"
    if error["type"] == "value_error":
        return f"{key} {error['ctx']['error']}"
    if error["type"] == "string_pattern_mismatch" and words_of(hints[key]).startswith("a text"):
        return f"{key} should be a text in one line, without control characters"
    hint = hints[key]
    for _ in path:
        hint = _inner(hint)
    return f"{key} should be {words_of(hint)}"
