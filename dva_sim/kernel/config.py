"""Check a file against a pydantic model; mistakes are reported by key.

Errors of pydantic are reported without Python terms: the mistake and the correct form. For an
unknown key, the key that was probably meant is suggested: a similar one, one at another place, or
one known by another name. `Key` and `AlsoCalled` annotate a field with its names.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError
from pydantic_core import CoreSchema

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.quantities import as_number
from dva_sim.kernel.retired import use_now
from dva_sim.kernel.suggestions import either, guess, listed, plain_name, unknown
from dva_sim.kernel.yaml_files import KeyPath

Scalar = bool | int | float | str | None

_DEPTH = 4  # maximum depth of nested keys
_MEANT = 3  # maximum keys of one name that are suggested
_UNITS = {
    "s": "seconds",
    "m": "metres",
    "mps": "metres per second",
    "hz": "hertz",
    "bps": "bits per second",
    "bytes": "bytes",
    "deg": "degrees",
    "rad": "radians",
}


@dataclass(frozen=True)
class AlsoCalled:
    """Other names that people try for a key: `Annotated[int, AlsoCalled("n")]`."""

    names: tuple[str, ...]

    def __init__(self, *names: str) -> None:
        object.__setattr__(self, "names", names)


@dataclass(frozen=True, eq=False)
class Key:
    """Readable name of a key: `Annotated[float, Key("one-way delay")]`.

    Attributes:
        title: Name as a factor of a study.
        stated: Name in a report's table of common conditions; True for the title, False if it is
            not in that table.
        inner: Names of keys below it, where they depend on the key above.
    """

    title: str = ""
    stated: bool | str = True
    inner: Mapping[str, Key] = field(default_factory=dict)

    @property
    def condition(self) -> str:
        """Name in a table of common conditions; empty if it is not in that table."""
        return self.stated if isinstance(self.stated, str) else self.title if self.stated else ""


def titled_keys(model: Any) -> dict[str, Key]:
    """Return every dotted key of a model that has a readable name, in the order of the model."""
    values: dict[str, Key] = {}
    for path, info in fields_below(model):
        for key in (m for m in info.metadata if isinstance(m, Key)):
            values |= {path: values.get(path, key)} if key.title else {}
            values |= {f"{path}.{name}": inner for name, inner in key.inner.items()}
    return values


def meant(path: KeyPath, value: Any, *models: Any) -> str:
    """Suggest a replacement of an unknown key: `did you mean 'x'?`, or list the known keys.

    Args:
        path: The key as it was given.
        value: Value given for the key.
        models: Models that the file may follow; the first contains the key's parent.
    """
    keys = keys_meant(path, value, *models)
    if keys:
        unit = keys[0].rpartition("_")[2]
        unit_written = str(path[-1]).rpartition("_")[2]
        text = f" (in {_UNITS[unit]})" if unit in _UNITS and unit_written != unit else ""
        return f"did you mean {either(map(repr, keys))}?{text}"
    siblings = fields_at(models[0], path[:-1])
    return f"known here: {listed(sorted(siblings), most=24)}" if siblings else ""


def keys_meant(path: KeyPath, value: Any, *models: Any) -> list[str]:
    """Return the keys that an unknown key may mean, for the same arguments as `meant`."""
    given = str(path[-1])
    siblings = fields_at(models[0], path[:-1])
    key_by_name = {} if isinstance(value, Mapping) else _every_name(models)
    exact = [
        key for name, key in key_by_name.items() if plain_name(name) == plain_name(_dotted(path))
    ]
    if exact:
        return exact
    beside = {name: name for name in siblings} | {
        other: name for name, info in siblings.items() for other in _alternative_names(info)
    }
    near = guess(given, beside)
    return _elsewhere(path, key_by_name) if near is None else [beside[near]]


def fields_at(model: Any, path: KeyPath) -> Mapping[str, Any]:
    """Return the fields of the model at `path` inside `model`, by name."""
    for number, step in enumerate(path, 1):
        if isinstance(step, int):
            continue
        info = _fields(model).get(step)
        if info is not None:  # None: the step is a user's own key in a mapping of models
            is_item = isinstance(next(iter(path[number:]), None), int)
            model = (None if is_item else _keyed(info)) or model_in(info.annotation)
    return _fields(model)


def _keyed(info: Any) -> Any:
    """Return the model of a list that may also be given as a mapping; None for other fields."""
    return next((m.keyed for m in info.metadata if hasattr(m, "keyed")), None)


def model_in(annotation: Any) -> Any:
    """Return the first pydantic model inside an annotation such as `tuple[Event, ...] | None`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        model = model_in(inner)
        if model is not None:
            return model
    return None


def _every_name(models: tuple[Any, ...]) -> dict[str, str]:
    """Return all dotted keys by their own names and their alternative names."""
    key_by_name: dict[str, str] = {}
    for key, info in (item for model in models for item in fields_below(model)):
        for name in (key, *_alternative_names(info)):
            key_by_name.setdefault(name, key)
    return key_by_name


def _elsewhere(path: KeyPath, key_by_name: Mapping[str, str]) -> list[str]:
    """Return keys of the same name at other places, or the most similar one."""
    last = plain_name(str(path[-1]))
    names = {name: plain_name(name.rpartition(".")[2]) for name in key_by_name}
    near = last if last in names.values() else guess(last, names.values())
    same = list(dict.fromkeys(key_by_name[name] for name, end in names.items() if end == near))
    least = min((key.count(".") for key in same), default=0)
    return [key for key in same if key.count(".") == least][:_MEANT]


def _dotted(path: KeyPath) -> str:
    return ".".join(map(str, path))


def fields_below(model: Any, above: str = "", depth: int = _DEPTH) -> Iterator[tuple[str, Any]]:
    """Yield every field of a model by its dotted key, each followed by its own fields."""
    for name, info in _fields(model).items():
        yield f"{above}{name}", info
        inner = model_in(info.annotation)
        if inner is not None and depth > 1:
            step = ".0" if "tuple" in str(info.annotation) else ""
            yield from fields_below(inner, f"{above}{name}{step}.", depth - 1)


def _fields(model: Any) -> dict[str, Any]:
    """Collect the fields of a model and of the model that takes its other keys."""
    further = getattr(model, "further_keys", None)
    fields: dict[str, Any] = dict(getattr(model, "model_fields", {}))
    return fields | (dict(further().model_fields) if further is not None else {})


def _alternative_names(info: Any) -> tuple[str, ...]:
    return tuple(n for m in info.metadata if isinstance(m, AlsoCalled) for n in m.names)


_SHOWN = 60  # maximum characters shown of a value

# Descriptions of valid values, by the error type of pydantic.
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
    model: type[BaseModel], data: Mapping[str, Any], errors: Sequence[Any]
) -> tuple[str, KeyPath]:
    """Return the first mistake, and the path of its key.

    Args:
        model: Model of the data.
        data: Plain data.
        errors: The errors of pydantic, at least one.
    """
    paths = [_path(e, data) for e in errors]
    if errors[0]["type"] == "missing" and isinstance(paths[0][-1], str):
        beside = [
            _dotted(path)
            for each, path in zip(errors, paths, strict=True)
            if each["type"] == "missing" and each["loc"][:-1] == errors[0]["loc"][:-1]
        ]
        *first, last = map(repr, beside)
        text = f"missing keys {', '.join(first)} and {last}" if first else f"missing key {last}"
        return text, paths[0]
    reports = [e for e, path in zip(errors, paths, strict=True) if path == paths[0]]
    return _explain(model, reports, paths[0]), paths[0]


def _path(problem: Any, data: Mapping[str, Any]) -> KeyPath:
    """Return the path of a key, without the union members that pydantic adds."""
    loc = problem["loc"]
    if loc and loc[-1] in _PLAIN and problem["type"].endswith("_type"):
        loc = loc[:-1]
    return tuple(part for part in loc if not _is_tag(part, data, loc))


def _is_tag(part: str | int, data: Any, loc: Sequence[str | int]) -> bool:
    """Return True if `part` of an error location names a union member rather than a key."""
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


def _explain(model: type[BaseModel], problems: Sequence[Any], path: KeyPath) -> str:
    """Return one mistake in words, from all errors at its path.

    Pydantic reports an error for each type of a union.
    """
    key = _dotted(path)
    first = problems[0]
    if first["type"] == "extra_forbidden":
        hint = meant(path, first["input"], model)
        if instead := use_now("key", key):
            return instead
        return f"unknown key {key!r}; {hint}" if hint else f"unknown key {key!r}"
    if first["type"] == "union_tag_not_found":
        return f"missing key '{key}.{_tag(first)}'"
    if first["type"] == "union_tag_invalid":
        tag = first["ctx"]["tag"]
        return f"{key}: {unknown(_tag(first), tag, _quoted(first['ctx']['expected_tags']))}"
    if first["type"] == "missing":
        *_, item = path
        return f"{key.removesuffix(f'.{item}')}: should have at least {int(item) + 1} items"
    message = _in_words(problems)
    if first["type"] in _BOUNDS:
        message += _measure(fields_at(model, path[:-1]).get(str(path[-1])), str(path[-1]), first)
    message += f"{_given(first, message)}{_instead(model, problems, path)}"
    return f"{key}: {message}" if key else message


def _measure(info: Any, name: str, problem: Any) -> str:
    """Return the unit of a bound, by the key's name; that of a maximum of 1 is a share."""
    unit = name.rpartition("_")[2]
    if unit in _UNITS and unit != name:
        return f" {_UNITS[unit]}"
    bound = problem["ctx"].get("le", problem["ctx"].get("lt", math.inf))
    is_whole = info is not None and "int" in str(info.annotation)
    return "" if bound > 1 or is_whole else " (a share: 0.05 is 5 %)"


def _given(problem: Any, message: str) -> str:
    """Return the given value for a message, unless it is long or already in it."""
    value = problem["input"]
    if value is None:
        return ", not null" if problem["type"] != "value_error" else ""
    text = repr(value)
    if not isinstance(value, str | int | float | bool):
        return ""
    if problem["type"] == "value_error" and text in message:
        return ""
    return f", not {text if len(text) <= _SHOWN else text[:_SHOWN] + '...'}"


def _instead(model: type[BaseModel], problems: Sequence[Any], path: KeyPath) -> str:
    """Suggest a correction, if one can be guessed."""
    value = problems[0]["input"]
    kinds = {problem["type"] for problem in problems}
    if isinstance(value, str) and "float_type" in kinds:
        number = as_number(str(path[-1]) if path else "", value)
        return f"; write {number}" if number else ""
    if isinstance(value, str) and "literal_error" in kinds:
        near = guess(value, _choices(problems[0]))
        return f"; did you mean {near!r}?" if near is not None else ""
    if kinds & {"model_type", "model_attributes_type"} and not isinstance(value, list | dict):
        keys = list(fields_at(model, path))
        return f", such as {_dotted((*path, keys[0]))}" if keys and path else ""
    return ""


def _in_words(problems: Sequence[Any]) -> str:
    """Describe valid values without Python terms."""
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
        allowed.remove(_KINDS["int_type"])  # "a number" includes it
    if first["type"] in _KINDS and allowed:
        return f"should be {_or(allowed)}"
    message: str = first["msg"].removeprefix("Value error, ").removeprefix("Input ")
    return message[0].lower() + message[1:]


def _or(words: Sequence[str]) -> str:
    """Return `a number, text, or true or false`."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])}, or {words[-1]}"


def _choices(problem: Any) -> list[str]:
    """Return the words that a value may have."""
    return _quoted(problem["ctx"]["expected"])


def _quoted(text: str) -> list[str]:
    return re.findall(r"'([^']*)'", text)


def _tag(problem: Any) -> str:
    """Return the key whose value selects the kind of a mapping."""
    return str(problem["ctx"]["discriminator"]).strip("'")


M = TypeVar("M", bound=BaseModel)
Fail = Callable[[str, KeyPath], ConfigError]
"""Factory of the error for a problem at a key path."""


def _make_strict(schema: Any) -> None:
    """Make numbers and truth values in a schema strict: no conversion from other types."""
    if isinstance(schema, dict):
        if schema.get("type") in ("int", "float", "bool"):
            schema["strict"] = True
        for key in schema.keys() - {"default", "metadata"}:
            _make_strict(schema[key])
    elif isinstance(schema, list | tuple):
        for inner in schema:
            _make_strict(inner)


class Config(BaseModel):
    """Base of all configuration: immutable, and unknown keys are mistakes.

    Numbers are not converted: `true` and `"2"` are not numbers, and `2.0` is not a whole number.
    """

    # Deferred: schemas are slow to build, and few programs need all of them.
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """Show only values that differ from the defaults, so that a scenario fits on a screen."""
        fields = type(self).model_fields
        for name, value in super().__repr_args__():
            info = fields.get(name or "")
            if info is None or value != info.get_default(call_default_factory=True):
                yield name, value

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the schema of the model, with its numbers and truth values strict."""
        schema = handler(source)
        _make_strict(schema)
        return schema


def validate(
    model: type[M],
    data: Mapping[str, Any],
    error: Fail = lambda problem, _: ConfigError(problem),
) -> M:
    """Build `model` from `data`.

    Args:
        model: The pydantic model.
        data: Plain data.
        error: Factory of the error for a problem at a key path; usually `Document.error`.

    Raises:
        ConfigError: the first mistake, with the key and what would be right.
    """
    try:
        return model.model_validate(data)
    except ValidationError as problems:
        text, path = first_mistake(model, data, problems.errors(include_url=False))
        raise error(text, path) from None
