"""Mistakes in a scenario, with the place where each was made.

Looking for the place takes all kinds of files, which a scenario without a mistake never needs:
`scenario_mistakes.mistakes_of` loads this module only when there is one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from dva_sim.experiments.study.file_kinds import of_other_kind, opened
from dva_sim.kernel.config_overrides import blame, parse_changes, set_by
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document, KeyPath
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.models import model_of

_COUNTS: Final = {
    "robots of the scenario": ("robot", "count"),
    "guards of the scenario": ("guard", "count"),
    "another bystander": ("bystander", "count"),
    "without robot.way_m": ("robot", "way_m"),
    "without guard.way_m": ("guard", "way_m"),
}


def placed_mistake(error: ConfigError, name: str, pairs: Sequence[str], seed: int) -> ConfigError:
    """Return a mistake in a scenario with its place: see `mistakes_of`."""
    if error.file is not None and not error.keys:
        return _of_other_kind(error, name) or error
    return _placed(error, name, pairs, seed)


def _of_other_kind(error: ConfigError, name: str) -> ConfigError | None:
    document = opened(lambda: scenarios.load(name))
    if document is None or error.file != str(document.file):
        return None
    return of_other_kind(document, "dva-sim episode", "scenario")


def _placed(error: ConfigError, name: str, pairs: Sequence[str], seed: int) -> ConfigError:
    """Return a mistake that has no place yet, if it is one of the scenario."""
    document = opened(lambda: scenarios.load(name))
    if document is None:
        return error
    changes = parse_changes(pairs)

    def make(some: Mapping[str, Any]) -> None:
        model = model_of(document)
        model.rehearse(model.build(document, some), seed)

    try:
        make(changes)
    except ConfigError:
        mistake = error if error.keys else blame(error, changes, make, document)
        return set_by(pairs, mistake) if mistake.keys else blamed_in(document, mistake)
    return error  # it can be run: the mistake is in what else was asked for


def blamed_in(document: Document, error: ConfigError) -> ConfigError:
    """Locate an error at the key that it concerns, unless another file holds it."""
    problem = error.problem
    if error.file is not None:
        if Path(error.file).exists():
            return error
        problem = f"{error.file!r}: {problem}"
    counts: list[KeyPath] = [path for phrase, path in _COUNTS.items() if phrase in problem]
    return document.error(problem, counts[0] if counts else _quoted(document, problem))


def _quoted(document: Document, problem: str) -> KeyPath:
    """Return the deepest key whose value the problem quotes."""
    for path in sorted(document.places, key=len, reverse=True):
        value: Any = document.data
        for step in path:
            value = value[step]
        if isinstance(value, str) and repr(value) in problem:
            return path
    return ()
