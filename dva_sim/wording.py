"""What is wrong with plain data, in words: what pydantic found, said without Python."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel

Path = tuple[str | int, ...]

# What a value may be, where it may be of several kinds.
_KINDS = {"float_type": "a number", "string_type": "text", "bool_type": "true or false"}
_STRUCTURES = {
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "a mapping of keys to values",
    "model_type": "a mapping of keys to values",
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
    paths = [tuple(p for p in e["loc"] if not _is_tag(p, data, e["loc"])) for e in found]
    told = [e for e, path in zip(found, paths, strict=True) if path == paths[0]]
    return _explain(model, told, paths[0]), paths[0]


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
        known = _fields_at(model, path[:-1])
        near = difflib.get_close_matches(str(path[-1]), known, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"known here: {', '.join(sorted(known))}"
        return f"unknown key {key!r}; {hint}" if known else f"unknown key {key!r}"
    if first["type"] == "missing":
        item = path[-1]
        if isinstance(item, int):
            return f"{key.removesuffix(f'.{item}')}: should have at least {item + 1} items"
        return f"missing key {key!r}"
    message, given = _in_words(problems), first["input"]
    shown = f", not {given!r}" if isinstance(given, str | int | float | bool) else ""
    return f"{key}: {message}{shown}" if key else f"{message}"


def _in_words(problems: Sequence[Any]) -> str:
    """What would be right, in words that need no Python."""
    kinds = {problem["type"]: problem for problem in problems}
    first = kinds.get("finite_number", problems[0])
    if first["type"] in ("too_short", "too_long"):
        few = first["type"] == "too_short"
        count = first["ctx"]["min_length" if few else "max_length"]
        items = "item" if count == 1 else "items"
        return f"should have at {'least' if few else 'most'} {count} {items}"
    allowed = [word for kind, word in _KINDS.items() if kind in kinds]
    if len(allowed) > 1 and first["type"] in _KINDS:
        return f"should be {', '.join(allowed[:-1])}, or {allowed[-1]}"
    if first["type"].startswith("int_") and isinstance(first["input"], float):
        return "should be a whole number, without a point"
    if first["type"] in _STRUCTURES:
        return f"should be {_STRUCTURES[first['type']]}"
    message: str = first["msg"].removeprefix("Value error, ")
    return message[0].lower() + message[1:]


def _fields_at(model: Any, path: Path) -> list[str]:
    """Names of the fields of the model that stands at `path` inside `model`."""
    for step in path:
        if isinstance(step, int):
            continue
        info = getattr(model, "model_fields", {}).get(step)
        if info is not None:  # else a key that the user chose, inside a mapping to models
            model = _model_in(info.annotation)
    return list(getattr(model, "model_fields", {}))


def _model_in(annotation: Any) -> Any:
    """The first pydantic model inside an annotation such as `tuple[Event, ...] | None`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        found = _model_in(inner)
        if found is not None:
            return found
    return None
