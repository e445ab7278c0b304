"""What `--set`, and the key `full` of a study, change: keys of the study, or of its scenarios."""

from __future__ import annotations

import copy
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from dva_sim.config import Path_
from dva_sim.errors import ConfigError


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
    touched: tuple[Path_, ...]

    def holds(self, path: Path_) -> bool:
        """Whether what stands at `path` is as it was."""
        return not any(path[: len(t)] == t for t in self.touched)


def change(before: Changed, pairs: Mapping[str, Any], known: Collection[str]) -> Changed:
    """Change some keys.

    A key of the study (`seed`, `factors.pattern`) changes the study. Any other is one of the
    scenario; if it is a factor, its value or list of values takes the place of its levels.

    Args:
        before: What is changed.
        pairs: New values by dotted key.
        known: Keys of a study.

    Raises:
        ConfigError: a part of a key that the study does not have.
    """
    data, changes, touched = copy.deepcopy(before.data), dict(before.changes), [*before.touched]
    factors = data.setdefault("factors", {})
    for key, value in pairs.items():
        path = _study_path(key, factors, known)
        if path is None:
            changes[key] = value
        else:
            _put(data, path, [value] if _is_level(path, value) else value)
            touched.append(path)
    return Changed(data, changes, tuple(touched))


def _study_path(
    key: str, factors: Mapping[str, Any], known: Collection[str]
) -> tuple[str, ...] | None:
    """Where a key stands in the study; None for a key of the scenario."""
    head, _, rest = key.partition(".")
    if key in factors:
        return "factors", key
    if head == "factors" and rest:
        return "factors", rest
    return tuple(key.split(".")) if head in known else None


def _is_level(path: tuple[str, ...], value: Any) -> bool:
    return path[0] == "factors" and len(path) == 2 and not isinstance(value, list)


def _put(data: dict[str, Any], path: tuple[str, ...], value: Any) -> None:
    for step in path[:-1]:
        inner = data.get(step)
        if not isinstance(inner, dict):
            raise ConfigError(f"no {step!r} in the study to change; there: {', '.join(data)}")
        data = inner
    data[path[-1]] = value
