"""The page of measures and columns: every column of every table, model by model."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from dva_sim.kernel.measure import Measure
from dva_sim.simulation.models import MODELS
from dva_sim.simulation.run_measures import PLUGINS
from generators.markdown import code, prose, sentence, table
from generators.markdown import page as page_of

_HEAD = """\
Each run gives one row of the table `runs`; some models have further tables. A study may ask for
every numeric column of `runs` as its `answer.measure`. Units stand at the end of a name. A duration
that waits for something counts with the whole horizon if that never comes.
`dva-sim show FOLDER --columns` prints the columns of finished results; in a folder that
`dva-sim export` wrote, `columns.csv` holds them."""


def page() -> str:
    """Return the page in Markdown."""
    return page_of("Measures and columns", _HEAD, *_models(), *_covariates())


def _covariates() -> Iterator[str]:
    yield "## Covariates"
    yield (
        "A study names these under `measures` to have them as columns, and under `covariates` to "
        "adjust its answer for them."
    )
    shipped: list[Any] = list(PLUGINS.shipped.values())
    yield _table(kind.about for kind in shipped)


def _models() -> Iterator[str]:
    for name, model in MODELS.items():
        for kind, columns in model.columns.items():
            yield f"## Model {name}: table {kind}"
            yield _table(columns)


def _table(columns: Iterable[Measure]) -> str:
    return table(["column", "unit", "title", "better", "meaning"], map(_row, columns))


def _row(column: Measure) -> list[str]:
    better = {"small": "smaller", "large": "larger"}[column.better] if column.is_number else ""
    title = prose(column.words) if column.is_number else ""
    return [code(column.name), column.unit, title, better, sentence(column.meaning)]
