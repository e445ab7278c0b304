"""What `--set`, and the key `full` of a study, change: keys of the study, or of its scenarios.

Settings as Python has them, as the `key=value` pairs of the command line.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

from dva_sim.kernel.config import KeyPath, meant, parse_scalar
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import hint


@dataclass(frozen=True)
class Changed:
    """A study's data with some keys changed.

    Attributes:
        data: As a file would hold it.
        changes: Keys of the scenarios, which hold in every part.
        touched: Where the data was changed.
    """

    data: dict[str, Any]
    changes: dict[str, Any]
    touched: tuple[KeyPath, ...]

    def holds(self, path: KeyPath) -> bool:
        """Whether what stands at `path` is as it was."""
        return not any(path[: len(t)] == t for t in self.touched)


def change(
    before: Changed,
    pairs: Mapping[str, Any],
    model: type[BaseModel],
    scenarios: Sequence[type[BaseModel]],
) -> Changed:
    """Change some keys.

    A key of the study (`seed`, `factors.pattern`) changes the study. Any other is one of the
    scenario; if it is a factor, its value or list of values takes the place of its levels.

    Args:
        before: What is changed.
        pairs: New values by dotted key.
        model: The keys of a study.
        scenarios: The keys of the scenarios that there are.

    Raises:
        ConfigError: a key that neither the study nor any scenario has.
    """
    data, changes, touched = copy.deepcopy(before.data), dict(before.changes), [*before.touched]
    factors = data.setdefault("factors", {})
    for key, value in pairs.items():
        first = key.partition(".")[0]
        if key not in factors and first not in model.model_fields:
            if not any(first in scenario.model_fields for scenario in scenarios):
                hint = meant(tuple(key.split(".")), value, model, *scenarios)
                raise ConfigError(f"unknown key {key!r}; {hint}")
            changes[key] = value
            continue
        path = ("factors", key) if key in factors else _path(data, key, model)
        _put(data, path, [value] if _is_level(path, value) else value)
        touched.append(path)
    return Changed(data, changes, tuple(touched))


def _is_level(path: tuple[str, ...], value: Any) -> bool:
    return path[0] == "factors" and len(path) == 2 and not isinstance(value, list)


def _path(data: Any, key: str, kind: Any) -> tuple[str, ...]:
    """Where a dotted key of the study stands, by what may stand there.

    Raises:
        ConfigError: it leads through what is not there, or to what holds no keys.
    """
    path: tuple[str, ...] = ()
    while key:
        kind = _bare(kind)
        there = data if isinstance(data, dict) else {}
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            step = key.partition(".")[0]
            field = kind.model_fields.get(step)
            kind = field.annotation if field is not None else None
        elif get_origin(kind) is dict:
            kind = get_args(kind)[1]
            step = _entry(there, key) if _holds_keys(_bare(kind)) else key
        else:
            raise ConfigError(f"{'.'.join(path)!r} holds no keys, so no {key!r}")
        path, key, data = (*path, step), key[len(step) + 1 :], there.get(step)
    return path


def _bare(kind: Any) -> Any:
    """A type without what may be said of it besides, and without its None."""
    while get_origin(kind) in (Annotated, Union, UnionType):
        kind = get_args(kind)[0]
    return kind


def _holds_keys(kind: Any) -> bool:
    return get_origin(kind) is dict or (isinstance(kind, type) and issubclass(kind, BaseModel))


def _entry(there: Mapping[str, Any], key: str) -> str:
    """The name in a mapping that a dotted key begins with; the whole key may be a new name."""
    names = [name for name in there if key == name or key.startswith(f"{name}.")]
    if not names and "." in key:
        first = key.partition(".")[0]
        raise ConfigError(f"no {first!r} in the study to change; {hint(first, there, 'there')}")
    return max(names, key=len, default=key)


def _put(data: dict[str, Any], path: tuple[str, ...], value: Any) -> None:
    for step in path[:-1]:
        if not isinstance(data.get(step), dict):
            data[step] = {}
        data = data[step]
    data[path[-1]] = value


Settings = Mapping[str, Any] | Iterable[str]


def pairs_of(settings: Settings, seed: int | None = None) -> list[str]:
    """Settings, and the seed if one is given, as on the command line.

    Raises:
        ConfigError: a value that no file could hold.
    """
    seeds = [] if seed is None else [f"seed={seed}"]
    if not isinstance(settings, Mapping):
        return [*settings, *seeds]
    return [*(f"{key}={_as_text(key, value)}" for key, value in settings.items()), *seeds]


def _as_text(key: str, value: Any) -> str:
    """A value as YAML: words as they are where that is possible, all else as JSON."""
    if isinstance(value, str | Path) and parse_scalar(str(value)) == str(value):
        return str(value)
    try:
        return json.dumps(value, default=_plain)
    except (TypeError, ValueError):
        raise ConfigError(f"set: {key} cannot be {value!r}") from None


def _plain(value: Any) -> Any:
    """Numbers and arrays of numpy, and paths, as JSON can hold them."""
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no number, word, list or mapping")
