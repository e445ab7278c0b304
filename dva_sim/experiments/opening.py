"""Opening what a user names, with mistakes told where they were made."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from dva_sim import scenario as scenarios
from dva_sim.changing import blame, parse_changes, set_by
from dva_sim.config import Document
from dva_sim.errors import ConfigError
from dva_sim.experiments.documents import blamed_in, of_other_kind
from dva_sim.experiments.models import model_of


@contextmanager
def mistakes_of(name: str, pairs: Sequence[str], seed: int) -> Iterator[None]:
    """Tell a mistake in a scenario at its key or at the `--set` that makes it.

    Args:
        name: The scenario, by name or path.
        pairs: `key=value` for each key that is changed.
        seed: Of the run.

    Raises:
        ConfigError: what was raised inside, with its place.
    """
    try:
        yield
    except ConfigError as error:
        if error.file is not None and not error.keys:
            raise _of_other_kind(error, name) or error from None
        raise _placed(error, name, pairs, seed) from None


def _of_other_kind(error: ConfigError, name: str) -> ConfigError | None:
    document = _document(name)
    if document is None or error.file != str(document.file):
        return None
    return of_other_kind(document, "dva-sim episode", "scenario")


def _document(name: str) -> Document | None:
    try:
        return scenarios.load(name)
    except ConfigError:
        return None


def _placed(error: ConfigError, name: str, pairs: Sequence[str], seed: int) -> ConfigError:
    """A mistake that has no place yet, if it is one of the scenario."""
    document = _document(name)
    if document is None:
        return error
    changes = parse_changes(pairs)

    def make(some: Mapping[str, Any]) -> None:
        model = model_of(document)
        model.rehearse(model.build(document, some), seed)

    try:
        make(changes)
    except ConfigError:
        found = error if error.keys else blame(error, changes, make, document)
        return set_by(pairs, found) if found.keys else blamed_in(document, found)
    return error  # it can be run: the mistake is in what else was asked for
