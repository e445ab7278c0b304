"""Frame of all validations: running the jobs, the outcome, and the files written.

Each kind judges by rules of its own and puts its lines into words; all else is alike: runs that
are spread over processes, tables, figures and a page.
"""

from __future__ import annotations

import base64
import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from dva_sim.experiments.execution import executors
from dva_sim.experiments.execution.scheduling import run_all
from dva_sim.experiments.report.figures.style import Drawn, finish
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.kernel.errors import DvaSimError, RunsFailed
from dva_sim.kernel.whole_files import whole, write_whole
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.models import AnyScenario, Tables

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Row = dict[str, Any]
Key = tuple[str, int]
Progress = Callable[[int], None]
_KINDS = {str: "VARCHAR", float: "DOUBLE", int: "BIGINT", bool: "BOOLEAN"}


def job_of(
    name: str, seed: int, scenario: object, *, person: int = 0, **asked: str | int
) -> StudyJob:
    """A job of a validation.

    Args:
        name: Name of the job, unique together with its seed.
        seed: Random seed.
        scenario: Scenario to run; a job without one has everything in `asked`.
        person: Person of the job.
        asked: Further input of its program.
    """
    cell = tuple(asked.items())
    return StudyJob(
        part=name,
        cell=cell,
        index=0,
        person=person,
        trial=0,
        seed=seed,
        config=name,
        scenario=cast(AnyScenario, scenario),
    )


def play_jobs(
    jobs: Sequence[StudyJob],
    program: Callable[[StudyJob], Tables],
    workers: int,
    failed: str,
    progress: Progress = lambda done: None,
    count: Callable[[list[Row]], int] = lambda rows: 1,
) -> dict[Key, list[Row]]:
    """The rows of each job by its key.

    Args:
        program: Plays one; all its rows are in a table `rows`.
        workers: Processes.
        failed: Message about a failed job, with a place for its name.
        progress: Callback with the progress.
        count: For how much the rows of a job count there.

    Raises:
        RunsFailed: one of them failed.
    """
    rows: dict[Key, list[Row]] = {}
    with executors.local(workers) as here, closing(run_all(jobs, program, here)) as batches:
        for batch in batches:
            for outcome in batch:
                if outcome.error is not None:
                    raise RunsFailed(f"{failed.format(outcome.key[0])}: {outcome.error}")
                rows[outcome.key] = json.loads(outcome.tables or "")["rows"]
            progress(sum(map(count, rows.values())))
    return rows


@dataclass(frozen=True)
class ResultSheet:
    """Lines that are read together: what is compared, with what, and mostly a verdict at the end.

    Attributes:
        title: Above it; empty for none.
        heads: Column headings.
        rows: Cells as text. On a page a row of two spans all columns: a title and its source.
        words: Columns that are read as words, not as numbers: these stand left.
        text: Introduction.
        wraps: True if long cells may take several lines.
        merged: True if rows with equal first cells share one.
        widths: In a terminal [characters]; None shares what is left. Empty: as needed.
    """

    title: str
    heads: tuple[str, ...]
    rows: Sequence[Sequence[str]]
    words: frozenset[int] = frozenset()
    text: str = ""
    wraps: bool = False
    merged: bool = False
    widths: tuple[int | None, ...] = ()

    @property
    def lines(self) -> list[Sequence[str]]:
        """The rows that have a cell in each column."""
        return [row for row in self.rows if len(row) == len(self.heads)]


@dataclass(frozen=True)
class ValidationResult:
    """Result of a validation.

    Attributes:
        name: `dispatch`, `operators` or `network`: of its table, and of its page's method.
        headline: Result in words.
        passes: True if all criteria hold.
        notes: Notes on the headline, one sentence each.
        conditions: Conditions of the validation, by name.
        sheets: Content of the page, in order.
        printed: Content on a terminal, in order.
        draw: Draws the figures, which takes a while.
        tables: Rows by name, each with the same keys.
        rule: Numbers that the page's method names.
    """

    name: str
    headline: str
    passes: bool
    notes: Sequence[str]
    conditions: Mapping[str, str]
    sheets: Sequence[ResultSheet]
    printed: Sequence[ResultSheet]
    draw: Callable[[], Sequence[Drawn]]
    tables: Mapping[str, Sequence[Row]]
    rule: tuple[float, ...] = ()

    def write(self, folder: Path) -> Path:
        """Write everything; the page's path.

        A table `NAME` becomes `NAME.csv` and `NAME.parquet`, a figure an SVG and a PNG.

        Args:
            folder: Folder; created if missing.

        Raises:
            DvaSimError: the folder cannot be written.
        """
        try:
            (folder / "figures").mkdir(parents=True, exist_ok=True)
            drawn = self.draw()
            for table, rows in self.tables.items():
                write_whole(folder / f"{table}.csv", _csv(rows))
                with whole(folder / f"{table}.parquet") as part:
                    _write_parquet(part, rows)
            for figure in drawn:
                write_whole(folder / "figures" / f"{figure.name}.svg", figure.svg)
                write_whole(folder / "figures" / f"{figure.name}.png", figure.png)
            path = folder / "index.html"
            write_whole(path, self.page(drawn))
        except OSError as error:
            raise DvaSimError(f"{folder} cannot be written: {error.strerror or error}") from None
        return path

    def page(self, drawn: Sequence[Drawn]) -> str:
        """Everything on one page, with figures inside and the look of all reports."""
        import jinja2  # late: start-up

        loader = jinja2.PackageLoader("dva_sim.validation", "templates")
        environment = jinja2.Environment(
            loader=loader, autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined
        )
        environment.filters["data_uri"] = _data_uri
        report = jinja2.PackageLoader("dva_sim.experiments.report")
        study = report.get_source(environment, "report.html.j2")[0]
        style = study.partition("<style>")[2].partition("</style>")[0]
        template = environment.get_template(f"{self.name}.html.j2")
        return template.render(style=style, found=self, drawn=drawn)


def captioned(figure: Figure, name: str, **numbers: object) -> Drawn:
    """A figure with its title and caption, which are in `templates/captions.yaml`.

    Args:
        figure: Figure to caption.
        name: Name of the figure.
        numbers: Numbers for the places in its caption.
    """
    words = load_yaml(Path(__file__).parent / "templates/captions.yaml").data[name]
    return finish(figure, name, words["title"], words["text"].format(**numbers))


def short_number(value: float | None) -> str:
    """Four digits that count, without an exponent; a dash where there is none."""
    if value is None or value != value:
        return "–"
    if abs(value) == float("inf"):
        return "∞"
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def _csv(rows: Sequence[Row]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]) if rows else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _write_parquet(path: Path, rows: Sequence[Row]) -> None:
    """One thread, rows in their order: the same bytes each time."""
    import duckdb  # late: start-up

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


def _kind(rows: Sequence[Row], name: str) -> str:
    """The type of a column, by its first value that is there."""
    values = (row[name] for row in rows if row[name] is not None)
    return _KINDS[type(next(values, 0.0))]


def _data_uri(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
