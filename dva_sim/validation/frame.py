"""What a validation leaves behind: a table as CSV and Parquet, figures, and a page.

How validations speak to the terminal.
"""

from __future__ import annotations

import base64
import csv
import io
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from dva_sim.experiments.report.figures import Drawn
from dva_sim.kernel.errors import DvaSimError

Row = dict[str, Any]
_KINDS = {str: "VARCHAR", float: "DOUBLE", int: "BIGINT", bool: "BOOLEAN"}


def write_all(
    folder: Path, tables: dict[str, list[Row]], drawn: Sequence[Drawn], page: str
) -> Path:
    """Write everything; the page's path.

    Args:
        folder: Made if it is not there.
        tables: Rows by name, each with the same keys; a table `NAME` becomes `NAME.csv` and
            `NAME.parquet`.
        drawn: Figures.
        page: HTML.

    Raises:
        DvaSimError: the folder cannot be written.
    """
    try:
        (folder / "figures").mkdir(parents=True, exist_ok=True)
        for table, rows in tables.items():
            (folder / f"{table}.csv").write_text(_csv(rows), encoding="utf-8", newline="")
            _write_parquet(folder / f"{table}.parquet", rows)
        for figure in drawn:
            (folder / "figures" / f"{figure.name}.svg").write_bytes(figure.svg)
            (folder / "figures" / f"{figure.name}.png").write_bytes(figure.png)
        path = folder / "index.html"
        path.write_text(page, encoding="utf-8", newline="\n")
    except OSError as error:
        raise DvaSimError(f"{folder} cannot be written: {error.strerror or error}") from None
    return path


def render(template: str, drawn: Sequence[Drawn], **filled: Any) -> str:
    """A page from a template, with the look of all pages and its figures inside.

    Args:
        template: File name among the templates of reports.
        drawn: Figures; the template gets them as pairs of figure and data URI.
        filled: What else the template asks for.
    """
    import jinja2

    loader = jinja2.PackageLoader("dva_sim.validation", "templates")
    environment = jinja2.Environment(
        loader=loader, autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined
    )
    report = jinja2.PackageLoader("dva_sim.experiments.report")
    study = report.get_source(environment, "report.html.j2")[0]
    style = study.partition("<style>")[2].partition("</style>")[0]
    figures = [(figure, _data_uri(figure.svg)) for figure in drawn]
    return environment.get_template(template).render(style=style, figures=figures, **filled)


def _csv(rows: list[Row]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]) if rows else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _write_parquet(path: Path, rows: list[Row]) -> None:
    """One thread, rows in their order: the same bytes each time."""
    import duckdb

    columns = ", ".join(f'"{name}" {_kind(rows, name)}' for name in rows[0])
    config: dict[str, str | bool | int | float | list[str]]
    config = {"threads": 1, "preserve_insertion_order": True}
    with duckdb.connect(config=config) as connection:
        connection.execute(f"CREATE TABLE checks ({columns})")
        marks = ", ".join("?" for _ in rows[0])
        connection.executemany(
            f"INSERT INTO checks VALUES ({marks})", [list(row.values()) for row in rows]
        )
        connection.execute("COPY checks TO $1 (FORMAT parquet, COMPRESSION zstd)", [str(path)])


def _kind(rows: list[Row], name: str) -> str:
    """The type of a column, by its first value that is there."""
    values = (row[name] for row in rows if row[name] is not None)
    return _KINDS[type(next(values, 0.0))]


def _data_uri(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"


WIDTH = 110  # of a table at least, also in a file

console = Console(highlight=False)
say = partial(console.print, soft_wrap=True)


def progress_bar() -> Progress:
    """A bar that says what is under way, how much of it is done, and for how long."""
    words = TextColumn("{task.description}")
    return Progress(words, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), console=console)
