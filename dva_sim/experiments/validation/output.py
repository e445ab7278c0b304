"""What a validation leaves behind: a table as CSV and Parquet, figures, and a page."""

from __future__ import annotations

import base64
import csv
import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from dva_sim.errors import DvaSimError
from dva_sim.experiments.figures import Drawn
from dva_sim.experiments.validation.estimation import (
    ERRORS,
    PRECISION,
    TOLERANCE,
    expected_alarms,
)
from dva_sim.experiments.validation.pictures import draw_all
from dva_sim.experiments.validation.play import LOOK_AGAIN, Check

NAME = "dispatch"


def write(folder: Path, checks: Sequence[Check], conditions: dict[str, str]) -> Path:
    """Write everything; the page's path.

    Args:
        folder: Made if it is not there.
        checks: What was compared.
        conditions: What the page says of how: seed, cases, quick or not.

    Raises:
        DvaSimError: the folder cannot be written.
    """
    drawn = draw_all(checks)
    rows = [_row(check) for check in checks]
    try:
        (folder / "figures").mkdir(parents=True, exist_ok=True)
        (folder / f"{NAME}.csv").write_text(_csv(rows), encoding="utf-8", newline="")
        _write_parquet(folder / f"{NAME}.parquet", rows)
        for figure in drawn:
            (folder / "figures" / f"{figure.name}.svg").write_bytes(figure.svg)
            (folder / "figures" / f"{figure.name}.png").write_bytes(figure.png)
        page = folder / "index.html"
        page.write_text(_page(checks, drawn, conditions), encoding="utf-8", newline="\n")
    except OSError as error:
        raise DvaSimError(f"{folder} cannot be written: {error.strerror or error}") from None
    return page


def headline(checks: Sequence[Check]) -> str:
    """The outcome in a sentence."""
    differs = [c for c in checks if c.verdict == "differs"]
    cases = len({c.case for c in checks})
    if differs:
        where = ", ".join(dict.fromkeys(c.case for c in differs))
        return f"{len(differs)} of {len(checks)} checks differ, in {where}."
    return f"All {len(checks)} checks of {cases} cases agree with the exact values."


def notes(checks: Sequence[Check], quick: bool) -> list[str]:
    """What belongs to the outcome: what is too rough, and what chance would do."""
    by_chance = [c for c in checks if c.found.error > 0]
    off = sum(abs(c.deviation) > ERRORS for c in by_chance)
    found = [
        f"{len(by_chance)} of the checks leave something to chance; if everything is right, up to "
        f"{expected_alarms(len(by_chance)):.1f} of them differ all the same, on average. "
        f"Here {off} lie beyond {ERRORS:g} standard errors."
    ]
    again = {c.case: c.again for c in checks if c.again}
    if again:
        shown = "; ".join(f"{case} ({why})" for case, why in again.items())
        found.append(
            f"Differed at first, so played again, {LOOK_AGAIN} times as long in all, and judged "
            f"by all runs together: {shown}."
        )
    rough = Counter(c.verdict for c in checks)["too rough"]
    if rough:
        why = "as is to be expected of a quick run" if quick else "so more runs are needed"
        found.append(
            f"{rough} checks agree, but their standard error is above "
            f"{100 * PRECISION:g} % of the exact value, {why}."
        )
    return found


def _row(check: Check) -> dict[str, Any]:
    found = asdict(check.found)
    row = {f.name: getattr(check, f.name) for f in fields(check) if f.name != "found"}
    row |= {"simulated": found["value"], "standard_error": found["error"]}
    row |= {"plain": found["plain"], "plain_standard_error": found["plain_error"]}
    row |= {"batches": found["batches"], "deviation": check.deviation}
    return row


def _csv(rows: list[dict[str, Any]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]) if rows else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _write_parquet(path: Path, rows: list[dict[str, Any]]) -> None:
    """One thread, rows in their order: the same bytes each time."""
    import duckdb

    kinds = {str: "VARCHAR", float: "DOUBLE", int: "BIGINT"}
    columns = ", ".join(f'"{name}" {kinds[type(value)]}' for name, value in rows[0].items())
    config: dict[str, str | bool | int | float | list[str]]
    config = {"threads": 1, "preserve_insertion_order": True}
    with duckdb.connect(config=config) as connection:
        connection.execute(f"CREATE TABLE checks ({columns})")
        marks = ", ".join("?" for _ in rows[0])
        connection.executemany(
            f"INSERT INTO checks VALUES ({marks})", [list(row.values()) for row in rows]
        )
        connection.execute("COPY checks TO $1 (FORMAT parquet, COMPRESSION zstd)", [str(path)])


def _page(checks: Sequence[Check], drawn: list[Drawn], conditions: dict[str, str]) -> str:
    import jinja2

    loader = jinja2.PackageLoader("dva_sim.experiments", "templates")
    environment = jinja2.Environment(
        loader=loader, autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined
    )
    study = loader.get_source(environment, "report.html.j2")[0]
    style = study.partition("<style>")[2].partition("</style>")[0]  # one look for all pages
    return environment.get_template("validation.html.j2").render(
        style=style,
        headline=headline(checks),
        notes=notes(checks, conditions.get("length") == "quick"),
        fails=any(c.verdict == "differs" for c in checks),
        conditions=conditions,
        figures=[(d, _data_uri(d.svg)) for d in drawn],
        groups=_groups(checks),
        rule=(ERRORS, 100 * TOLERANCE, 100 * PRECISION, LOOK_AGAIN),
    )


def _groups(checks: Sequence[Check]) -> list[tuple[str, list[list[str]]]]:
    """Checks case by case, as the words of a table."""
    groups: dict[str, list[list[str]]] = {}
    for check in checks:
        groups.setdefault(check.title, []).append(words(check))
    return list(groups.items())


HEADS = ("measure", "exact", "simulated", "std. error", "deviation", "verdict")


def words(check: Check) -> list[str]:
    """A check in words: measure, exact, simulated, standard error, deviation, verdict."""
    found, exact = check.found, check.exact
    off = f"{check.deviation:+.2f} SE" if found.error > 0 else "-"
    return [
        check.measure,
        f"{exact:.6g}",
        f"{found.value:.6g}",
        f"{found.error:.2g}" if found.error > 0 else "0",
        off,
        check.verdict,
    ]


def _data_uri(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
