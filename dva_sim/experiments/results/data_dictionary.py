"""The data dictionary: what every column of every table means. Its unit is the end of its name.

Times of events are seconds of the run; what did not happen is missing (nan, or empty in CSV).
Columns `*_share` are from 0 to 1, and columns of counts have no unit. What is measured is said
where it is computed (`Model.columns`); here stands what the design of a study adds.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from dva_sim.experiments.study.parts import DESIGN, REPEATS
from dva_sim.kernel.units import unit_of
from dva_sim.simulation.models import MODELS

Told = Mapping[str, Mapping[str, Mapping[str, Any]]]
"""What a results folder tells itself of columns that are none of ours, by table and name."""


class Column(NamedTuple):
    """A line of the dictionary.

    Attributes:
        table: Name of the table.
        name: Of the column.
        unit: As printed; empty for what has none.
        meaning: In words; empty if nothing is known of it.
    """

    table: str
    name: str
    unit: str
    meaning: str


def describe(
    table: str,
    columns: Sequence[str],
    models: Sequence[str],
    factors: Sequence[str],
    told: Told | None = None,
) -> list[Column]:
    """Describe some columns of a table of results.

    Args:
        table: Its name.
        columns: Their names.
        models: Those of the study's parts; where meanings differ, all are given.
        factors: Names of the study's factors.
        told: What the results tell of columns that users have added.
    """
    table_of = "runs" if table == REPEATS else table
    added = (told or {}).get(table_of, {})
    return [
        Column(table, name, unit_of(name), _meaning(table_of, name, models, factors, added))
        for name in columns
    ]


def _meaning(
    table: str,
    name: str,
    models: Iterable[str],
    factors: Sequence[str],
    added: Mapping[str, Mapping[str, Any]],
) -> str:
    if name in factors:
        return f"factor of the study: the scenario key {name}"
    if name in DESIGN:
        return DESIGN[name]
    if name in added:
        return str(added[name]["meaning"])
    known = {model: meaning for model in models if (meaning := _of_model(model, table, name))}
    if len(set(known.values())) <= 1:
        return next(iter(known.values()), "")
    return "; ".join(f"{model}: {meaning}" for model, meaning in known.items())


def _of_model(model: str, table: str, name: str) -> str:
    """What one of our models says; of others the results tell themselves."""
    columns = MODELS[model].columns.get(table, ()) if model in MODELS else ()
    return next((column.meaning for column in columns if column.name == name), "")
