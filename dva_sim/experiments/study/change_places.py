"""The origin of a mistake in a study's scenario: `--set`, or a file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from dva_sim.experiments.study.factor_levels import path_in_design
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import KeyPath


def located(study: Study, part: str, error: ConfigError, changes: Mapping[str, Any]) -> ConfigError:
    """The mistake at what makes it; as it is if a file has been named.

    Args:
        study: Study that runs the scenario.
        error: Error with the keys at fault, if changes of the scenario caused it.
        changes: All changes of the scenario.
    """
    if error.file is not None:
        return error
    problem = error.problem
    named = [
        k for k, v in changes.items() if k in problem or (isinstance(v, str) and repr(v) in problem)
    ]
    keys = error.keys if len(error.keys) == 1 else (named or list(error.keys))
    for key in keys:
        if pair := study.setting_of(tuple(key.split("."))):
            return ConfigError(f"--set {pair}: {error.problem.removeprefix(f'{key}: ')}")
    for key in keys:
        for path in _places(study, part, key, changes[key]):
            if study.is_from_file(path):
                return study.error(error.problem, path)
    # What the study's file does not say is in the settings, if there are any.
    pairs = ", ".join(f"--set {pair}" for pair in study.settings)
    return ConfigError(f"{pairs}: {error.problem}") if keys and pairs else error


def _places(study: Study, part: str, key: str, value: Any) -> Iterator[KeyPath]:
    """Places where the study may give a scenario key that value."""
    yield "factors", key
    yield "parts", part, "reference", key
    yield "parts", part, "changes", key
    for factor, levels in study.treatments.items():
        for level in levels:
            yield "treatments", factor, level, key
    if study.version is not None:
        yield study.version, key
    if (in_design := path_in_design(study, key, value)) is not None:
        yield in_design
