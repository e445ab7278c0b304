"""Result of a validation: its evidence, and its page and tables."""

from __future__ import annotations

import base64
import csv
import io
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import groupby
from pathlib import Path
from typing import Final

from dva_sim.experiments.report.figures.style import Drawn
from dva_sim.kernel.errors import DvaSimError
from dva_sim.kernel.whole_files import whole, write_whole
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.validation import figure
from dva_sim.validation.evidence import (
    HEADS,
    RULE,
    SUBJECTS,
    Evidence,
    Subject,
    describe_count,
    headline,
    judged,
    names_of_misses,
    passes,
    read_evidence,
    state_of_rule,
)
from dva_sim.validation.frame import Row

NAME: Final = "evidence"
LONG: Final = 40  # lines; of a longer group a terminal only shows the failures
TITLES: Final[dict[Subject, str]] = {
    "dispatch": "Dispatch beside theory",
    "operators": "Operators beside people",
    "network": "Network beside real sockets",
    "middleware": "Middleware beside real programs",
}
_KINDS = {str: "VARCHAR", float: "DOUBLE", int: "BIGINT", bool: "BOOLEAN"}


@dataclass(frozen=True)
class ResultSheet:
    """Lines that are read together.

    Attributes:
        title: Title above the lines.
        heads: Column headings.
        rows: Cells as text.
        text: Introduction.
    """

    title: str
    heads: tuple[str, ...]
    rows: Sequence[Sequence[str]]
    text: str = ""


@dataclass(frozen=True)
class ValidationResult:
    """Result of a validation.

    Attributes:
        lines: Evidence of one subject, with the lines of its rule.
        notes: Notes on the headline, one sentence each.
        conditions: Conditions of the validation, by name.
        sheets: Further tables, for facts outside of the evidence.
        tables: Further tables to write: rows by name, each row with the same keys.
        draw: Draws further figures, which takes a while.
    """

    lines: Sequence[Evidence]
    notes: Sequence[str] = ()
    conditions: Mapping[str, str] = field(default_factory=dict)
    sheets: Sequence[ResultSheet] = ()
    tables: Mapping[str, Sequence[Row]] = field(default_factory=dict)
    draw: Callable[[], Sequence[Drawn]] = tuple

    @property
    def headline(self) -> str:
        """Present state in words."""
        return headline(self.lines)

    @property
    def passes(self) -> bool:
        """True if the rule holds."""
        return passes(self.lines)

    @property
    def under_conditions(self) -> list[Evidence]:
        """The lines, with the conditions as the source of those of the rule."""
        text = "; ".join(f"{name}: {value}" for name, value in self.conditions.items())
        return [replace(e, source=text) if e.group == RULE else e for e in self.lines]

    @property
    def printed(self) -> list[ResultSheet]:
        """Tables for a terminal, in order."""
        *groups, rule = make_sheets(self.lines, LONG)
        sheets = [sheet for sheet in groups if sheet.rows or sheet.text]
        return [*sheets, *not_judged(self.lines), *self.sheets, rule]

    def write(self, folder: Path) -> Path:
        """Write everything; the page's path.

        Lines of other subjects that the folder holds already stay in its table, page and figure.
        A table `NAME` becomes `NAME.csv` and `NAME.parquet`, a figure an SVG and a PNG.

        Args:
            folder: Folder; created if missing.

        Raises:
            ConfigError: the folder holds another table of that name.
            DvaSimError: the folder cannot be written.
        """
        table = folder / f"{NAME}.csv"
        others = read_evidence(table) if table.exists() else []
        own = {line.subject for line in self.lines}
        lines = [*(e for e in others if e.subject not in own), *self.under_conditions]
        lines.sort(key=lambda line: SUBJECTS.index(line.subject))
        try:
            (folder / "figures").mkdir(parents=True, exist_ok=True)
            drawn = [figure.draw(lines), *self.draw()]
            for name, rows in {NAME: list(map(asdict, lines)), **self.tables}.items():
                write_whole(folder / f"{name}.csv", _csv(rows))
                with whole(folder / f"{name}.parquet") as part:
                    _write_parquet(part, rows)
            for each in drawn:
                write_whole(folder / "figures" / f"{each.name}.svg", each.svg)
                write_whole(folder / "figures" / f"{each.name}.png", each.png)
            path = folder / "index.html"
            write_whole(path, page(self, lines, drawn))
        except OSError as error:
            raise DvaSimError(f"{folder} cannot be written: {error.strerror or error}") from None
        return path


def make_sheets(lines: Sequence[Evidence], most: int | None = None) -> list[ResultSheet]:
    """Return a sheet for each group of the lines of a subject, the rule last.

    Args:
        most: Number of lines above which a group has only those that were judged and do not hold.
    """
    groups: dict[str, list[Evidence]] = {}
    for line in lines:
        groups.setdefault(line.group, []).append(line)
    groups[RULE] = groups.pop(RULE, [])
    return [_sheet(title, own, most) for title, own in groups.items()]


def _sheet(title: str, lines: Sequence[Evidence], most: int | None) -> ResultSheet:
    """Return the rows of a group; a row of one cell is the source of the rows below it."""
    printed = lines
    text = ""
    if most is not None and len(lines) > most:
        # A terminal would scroll the head away.
        printed = [line for line in lines if line.verdict in ("misses", "too rough")]
        text = f"{describe_count(lines)}." if judged(lines) else ""
    rows: list[tuple[str, ...]] = []
    for source, own in groupby(printed, lambda line: line.source):
        rows += [(source,)] if source else []
        rows += [line.words for line in own]
    return ResultSheet(title, HEADS, rows, text)


def not_judged(lines: Sequence[Evidence]) -> list[ResultSheet]:
    """Return reasons why lines have no verdict, with their number."""
    reasons = Counter(e.note for e in lines if e.verdict == "shown only" and e.group != RULE)
    rows = [(why, str(count)) for why, count in reasons.items()]
    return [ResultSheet("Not judged", ("why", "lines"), rows)] if rows else []


def page(result: ValidationResult, lines: Sequence[Evidence], drawn: Sequence[Drawn]) -> str:
    """Return everything on one page, with figures inside and the look of all reports.

    Args:
        lines: Evidence of this result, and of other subjects.
        drawn: The figures.
    """
    import jinja2  # late: start-up

    loader = jinja2.PackageLoader("dva_sim.validation", "templates")
    environment = jinja2.Environment(
        loader=loader, autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters["data_uri"] = _data_uri
    report = jinja2.PackageLoader("dva_sim.experiments.report")
    study = report.get_source(environment, "report.html.j2")[0]
    by_subject = {s: [e for e in lines if e.subject == s] for s in SUBJECTS}
    return environment.get_template("evidence.html.j2").render(
        style=study.partition("<style>")[2].partition("</style>")[0],
        result=result,
        drawn=drawn,
        titles=TITLES,
        methods=load_yaml(Path(__file__).parent / "templates/methods.yaml").data,
        subjects={subject: own for subject, own in by_subject.items() if own},
        count=describe_count,
        misses=names_of_misses,
        rule=state_of_rule,
        passes=passes,
        sheets=make_sheets,
        long=LONG,
    )


def _csv(rows: Sequence[Row]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]) if rows else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _write_parquet(path: Path, rows: Sequence[Row]) -> None:
    """Write with one thread and rows in order, so that the bytes are the same each time."""
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
    """Return the type of a column, by its first present value."""
    values = (row[name] for row in rows if row[name] is not None)
    return _KINDS[type(next(values, 0.0))]


def _data_uri(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
