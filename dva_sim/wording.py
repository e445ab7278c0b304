"""What is wrong with plain data, in words: what pydantic found, said without Python."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from dva_sim.guesses import either, guess, unknown
from dva_sim.key_hints import Path, fields_at, meant
from dva_sim.value_hints import as_number

_SHOWN = 60  # characters of a value

# What a value should be, by what pydantic says that it is not.
_KINDS = {
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "text",
    "bool_type": "true or false",
    "none_required": "null",
}
_PLAIN = ("bool", "int", "float", "str")
_STRUCTURES = {
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "a mapping of keys to values",
    "model_type": "a mapping of keys to values",
    "model_attributes_type": "a mapping of keys to values",
}
_BOUNDS = {
    "greater_than": ("above", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("below", "lt"),
    "less_than_equal": ("at most", "le"),
}


def first_mistake(
    model: type[BaseModel], data: Mapping[str, Any], found: Sequence[Any]
) -> tuple[str, Path]:
    """The first mistake, and the path of the key that it is about.

    Args:
        model: What the data should be.
        data: Plain data.
        found: The errors of pydantic, at least one.
    """
    paths = [_path(e, data) for e in found]
    told = [e for e, path in zip(found, paths, strict=True) if path == paths[0]]
    return _explain(model, told, paths[0]), paths[0]


def _path(problem: Any, data: Mapping[str, Any]) -> Path:
    """The path of a key, without what names one of several kinds that a value may be of."""
    loc = problem["loc"]
    if loc and loc[-1] in _PLAIN and problem["type"].endswith("_type"):
        loc = loc[:-1]
    return tuple(part for part in loc if not _is_tag(part, data, loc))


def _is_tag(part: str | int, data: Any, loc: Sequence[str | int]) -> bool:
    """Whether `part` of an error location names a union member rather than a key."""
    for step in loc:
        inside = isinstance(data, Mapping) and step in data
        inside = inside or (isinstance(data, list) and isinstance(step, int) and step < len(data))
        if step == part:
            # The last part is a missing key where there are keys.
            is_key = step == loc[-1] and isinstance(data, Mapping)
            return not inside and not is_key and isinstance(step, str)
        if inside:
            data = data[step]
    return False


def _explain(model: type[BaseModel], problems: Sequence[Any], path: Path) -> str:
    """One mistake in words, from all that was found at its place: one for each kind allowed."""
    key, first = ".".join(str(p) for p in path), problems[0]
    if first["type"] == "extra_forbidden":
        hint = meant(path, first["input"], model)
        return f"unknown key {key!r}; {hint}" if hint else f"unknown key {key!r}"
    if first["type"] == "union_tag_not_found":
        return f"missing key '{key}.{_tag(first)}'"
    if first["type"] == "union_tag_invalid":
        tag = first["ctx"]["tag"]
        return f"{key}: {unknown(_tag(first), tag, _quoted(first['ctx']['expected_tags']))}"
    if first["type"] == "missing":
        item = path[-1]
        if isinstance(item, int):
            return f"{key.removesuffix(f'.{item}')}: should have at least {item + 1} items"
        return f"missing key {key!r}"
    message = _in_words(problems)
    message += f"{_given(first, message)}{_instead(model, problems, path)}"
    return f"{key}: {message}" if key else message


def _given(problem: Any, message: str) -> str:
    """The value there is, unless it is long or has been told already."""
    given = problem["input"]
    if given is None:
        return ", not null" if problem["type"] != "value_error" else ""
    shown = repr(given)
    if not isinstance(given, str | int | float | bool):
        return ""
    if problem["type"] == "value_error" and shown in message:
        return ""
    return f", not {shown if len(shown) <= _SHOWN else shown[:_SHOWN] + '...'}"


def _instead(model: type[BaseModel], problems: Sequence[Any], path: Path) -> str:
    """What to write instead, where that can be guessed."""
    given, kinds = problems[0]["input"], {problem["type"] for problem in problems}
    if isinstance(given, str) and "float_type" in kinds:
        number = as_number(str(path[-1]) if path else "", given)
        return f"; write {number}" if number else ""
    if isinstance(given, str) and "literal_error" in kinds:
        near = guess(given, _choices(problems[0]))
        return f"; did you mean {near!r}?" if near is not None else ""
    if kinds & {"model_type", "model_attributes_type"} and not isinstance(given, list | dict):
        keys = list(fields_at(model, path))
        return f", such as {'.'.join(map(str, (*path, keys[0])))}" if keys and path else ""
    return ""


def _in_words(problems: Sequence[Any]) -> str:
    """What would be right, in words that need no Python."""
    kinds = {problem["type"]: problem for problem in problems}
    first = kinds.get("finite_number", problems[0])
    if first["type"] in ("too_short", "too_long"):
        few = first["type"] == "too_short"
        count = first["ctx"]["min_length" if few else "max_length"]
        items = "item" if count == 1 else "items"
        return f"should have at {'least' if few else 'most'} {count} {items}"
    if first["type"] in _BOUNDS:
        word, name = _BOUNDS[first["type"]]
        return f"should be {word} {first['ctx'][name]:g}"
    if first["type"] == "literal_error":
        return f"should be {either(_choices(first))}"
    if first["type"].startswith("int_") and isinstance(first["input"], float):
        return "should be a whole number, without a point"
    if first["type"] in _STRUCTURES:
        return f"should be {_STRUCTURES[first['type']]}"
    allowed = [word for kind, word in _KINDS.items() if kind in kinds]
    if "float_type" in kinds and "int_type" in kinds:
        allowed.remove(_KINDS["int_type"])  # which is a number, too
    if first["type"] in _KINDS and allowed:
        return f"should be {_or(allowed)}"
    message: str = first["msg"].removeprefix("Value error, ").removeprefix("Input ")
    return message[0].lower() + message[1:]


def _or(words: Sequence[str]) -> str:
    """`a number, text, or true or false`."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])}, or {words[-1]}"


def _choices(problem: Any) -> list[str]:
    """The words that a value should be one of."""
    return _quoted(problem["ctx"]["expected"])


def _quoted(text: str) -> list[str]:
    return re.findall(r"'([^']*)'", text)


def _tag(problem: Any) -> str:
    """The key whose value says of which kind a mapping is."""
    return str(problem["ctx"]["discriminator"]).strip("'")
