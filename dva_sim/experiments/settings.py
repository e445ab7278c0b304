"""Settings as Python has them, as the `key=value` pairs of the command line."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from dva_sim.config import parse_scalar
from dva_sim.errors import ConfigError

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
