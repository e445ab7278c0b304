"""Where in a study a mistake of one of its scenarios was made: at a key of its file, or `--set`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from dva_sim.config import Path_
from dva_sim.errors import ConfigError
from dva_sim.experiments import designs
from dva_sim.experiments.study import Study


def blamed(study: Study, part: str, error: ConfigError, changes: Mapping[str, Any]) -> ConfigError:
    """The mistake at the key of the study that makes it; as it is if a file has been named."""
    if error.file is not None:
        return error
    named = {key: value for key, value in changes.items() if _is_named(key, value, error.problem)}
    for key, value in named.items():
        for path in _places(study, part, key, value):
            if study.is_from_file(path):
                return study.error(error.problem, path)
    return in_setting(study, error) if named else error


def in_setting(study: Study, error: ConfigError) -> ConfigError:
    """A mistake in what the study's file does not say: in a setting, if there are any."""
    return ConfigError(f"--set: {error.problem}") if study.settings else error


def _is_named(key: str, value: Any, problem: str) -> bool:
    return key in problem or (isinstance(value, str) and repr(value) in problem)


def _places(study: Study, part: str, key: str, value: Any) -> Iterator[Path_]:
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
