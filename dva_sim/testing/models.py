"""Checks of run models, on a scenario of their own and on scenarios near it."""

from __future__ import annotations

import math
import pickle
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document
from dva_sim.simulation.models import Model, Tables, model_of
from dva_sim.testing.promises import Case, Outcome, broken_in, is_slow, kept, part_by_part

SEEDS: Final = (1, 2, 3)
SLOW: Final = 60.0  # [s] of one run; above that it earns a warning
FACTORS: Final = (0.0, 0.5, 2.0)  # by which each number of the scenario is changed in turn


def check_model(
    name: str, options: Mapping[str, Any] | None = None, *, slow: float = SLOW
) -> Outcome:
    """See that a model keeps what every model promises.

    It is tried with the scenario that its defaults and some keys make.

    Args:
        name: Name of the model, as in a scenario.
        options: Keys of its scenario; those that have no default must be there.
        slow: A run that takes longer earns a warning [s].

    Raises:
        BrokenPromises: it does not; a line for each promise.
        ConfigError: there is no such model, or no such scenario of it.
    """
    keys = options or {}
    document = Document({"model": name}, Path("scenario.yaml").absolute())
    model = model_of(document)
    try:
        scenario = model.build(document, keys)
    except ConfigError as error:
        raise ConfigError(f"{error.problem}; --set gives keys of its scenario") from None
    trial = _Trial(model, scenario, document, keys)
    broken = broken_in(part_by_part(trial.parts))
    slowest = max(trial.took, default=0.0)
    warnings = is_slow(slowest, slow, "a run")
    if not broken and len(set(trial.seen)) == 1:
        warnings.append("comes to the same with every seed")
    return kept(broken, warnings, len(trial.took), slowest)


class _Trial:
    """All that is tried with one model.

    Attributes:
        took: Duration of each run [s].
        seen: Results of runs with several seeds.
    """

    def __init__(
        self, model: Model[Any], scenario: Any, document: Document, keys: Mapping[str, Any]
    ) -> None:
        self._model, self._scenario = model, scenario
        self._document, self._keys = document, keys
        self.took, self.seen = list[float](), list[str]()
        self.parts = self._travels, self._runs, self._columns, self._rehearses

    def _run(self, scenario: Any, seed: int) -> Tables:
        started = time.perf_counter()
        tables = self._model.tables(scenario, seed, with_tracks=True)
        self.took.append(time.perf_counter() - started)
        return tables

    def _travels(self) -> Iterator[Case]:
        """To another process, as the runner sends it."""
        there = pickle.loads(pickle.dumps(self._scenario))
        if there.model_dump() != self._scenario.model_dump():
            yield "its scenario is another one in another process", repr(there)

    def _runs(self) -> Iterator[Case]:
        """Check that the same seed gives the same result after any other runs."""
        before = repr(self._scenario.model_dump())
        first = {seed: repr(self._run(self._scenario, seed)) for seed in SEEDS}
        self.seen.extend(first.values())
        for seed in reversed(SEEDS):
            if repr(self._run(self._scenario, seed)) != first[seed]:
                yield "comes to something else with the same seed", f"seed {seed}"
        if repr(self._scenario.model_dump()) != before:
            yield "changes its scenario", before

    def _columns(self) -> Iterator[Case]:
        """Check the declared tables and columns against the actual ones."""
        tables = self._run(self._scenario, SEEDS[0])
        if len(tables.get("runs", ())) != 1:
            yield "has not one row for a run", f"{len(tables.get('runs', ()))} in table 'runs'"
        for table in tables.keys() - self._model.columns.keys():
            yield "has a table that it does not declare", table
        for table, rows in tables.items():
            yield from self._rows(table, rows)
        asked = set(self._model.measures(self._scenario))
        for name in sorted(asked - set().union(*tables.get("runs", ()))):
            yield "lacks a measure that a study may ask for", name

    def _rows(self, table: str, rows: list[dict[str, Any]]) -> Iterator[Case]:
        known = {column.name: column for column in self._model.columns.get(table, ())}
        for number, row in enumerate(rows):
            for name, value in row.items():
                where = f"{name} = {value!r} in row {number + 1} of {table!r}"
                if name not in known:
                    yield "has a column that it does not declare", where
                elif known[name].is_number:
                    yield from _of_number(value, known[name].bounds, where)
                elif not isinstance(value, str):
                    yield "has something else than words in a column of words", where

    def _rehearses(self) -> Iterator[Case]:
        """Check that scenarios that cannot run are rejected before they run."""
        for key, value in self._scenario.model_dump().items():
            if not isinstance(value, int | float) or isinstance(value, bool):
                continue
            for factor in FACTORS:
                yield from self._near({key: type(value)(factor * value)})

    def _near(self, change: dict[str, Any]) -> Iterator[Case]:
        try:
            scenario = self._model.build(self._document, {**self._keys, **change})
            self._model.rehearse(scenario, SEEDS[0])
        except ConfigError:
            return
        try:
            self._run(scenario, SEEDS[0])
        except Exception as error:
            text = f"{type(error).__name__}: {error}, with {change}"
            yield "fails in a run that its rehearsal let through", text


def _of_number(value: Any, bounds: tuple[float, float], where: str) -> Iterator[Case]:
    if isinstance(value, str) or not hasattr(value, "__float__"):
        yield "has no number in a column of numbers", where
    elif math.isinf(value):
        yield "has an infinite number", where
    elif value < bounds[0] or value > bounds[1]:
        yield "leaves the bounds of a column", f"{where}; bounds {bounds[0]:g} to {bounds[1]:g}"
