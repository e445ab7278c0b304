"""Where in a study a mistake of one of its scenarios was made: by `--set`, or in a file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from dva_sim.experiments.study import designs
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.config import KeyPath
from dva_sim.kernel.errors import ConfigError


def blamed(study: Study, part: str, error: ConfigError, changes: Mapping[str, Any]) -> ConfigError:
    """The mistake at what makes it; as it is if a file has been named.

    Args:
        study: Whose scenario it is.
        part: Which one.
        error: With the keys at fault, if changes of the scenario are.
        changes: All changes of the scenario.
    """
    if error.file is not None:
        return error
    named = [key for key, value in changes.items() if _is_named(key, value, error.problem)]
    keys = error.keys if len(error.keys) == 1 else (named or list(error.keys))
    for key in keys:
        if pair := study.setting_of(tuple(key.split("."))):
            return ConfigError(f"--set {pair}: {error.problem.removeprefix(f'{key}: ')}")
    for key in keys:
        for path in _places(study, part, key, changes[key]):
            if study.is_from_file(path):
                return study.error(error.problem, path)
    return in_setting(study, error) if keys else error


def in_setting(study: Study, error: ConfigError) -> ConfigError:
    """A mistake in what the study's file does not say: in the settings, if there are any."""
    pairs = ", ".join(f"--set {pair}" for pair in study.settings)
    return ConfigError(f"{pairs}: {error.problem}") if pairs else error


def _is_named(key: str, value: Any, problem: str) -> bool:
    return key in problem or (isinstance(value, str) and repr(value) in problem)


def _places(study: Study, part: str, key: str, value: Any) -> Iterator[KeyPath]:
    """Where the study might give a key of its scenarios that value."""
    yield "factors", key
    yield "parts", part, "reference", key
    yield "parts", part, "changes", key
    for factor, levels in study.treatments.items():
        for level in levels:
            yield "treatments", factor, level, key
    if study.version is not None:
        yield study.version, key
    in_design = designs.place_of(study, key, value)
    if in_design is not None:
        yield in_design
