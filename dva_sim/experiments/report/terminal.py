"""Results as a terminal shows them: the answer and every cell, a table, or what columns mean.

Used by the command `dva-sim show`, and by programs as `dva_sim.show`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from dva_sim.experiments.report.study_size import not_reached, plan_lines, runs_of
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.manifest import status_of
from dva_sim.experiments.results.results import Results, plain

_GAP = 2  # between columns
_ENDS = {
    "enough": "its interval is narrow enough",
    "budget": "its time is spent",
    "limit": "no more were allowed",
}


def show(
    results: Results, table: str | None, columns: bool, rows: int, console: Console | None = None
) -> None:
    """Show what results hold: the answer, a table, or what columns mean.

    Raises:
        ConfigError: no such table.
    """
    console = console or Console(highlight=False)
    if columns:
        show_columns(results, [] if table is None else [table], console)
    elif table is not None:
        show_table(results, table, rows, console)
    else:
        show_results(results, console)


def show_results(results: Results, console: Console) -> None:
    """Print question, status, answer, warnings, every cell, and where it comes from."""
    reading = Reading(results)
    console.print(f"[bold]{escape(results.question)}[/bold]", soft_wrap=True)
    if results.partial:
        console.print(f"[bold yellow]{escape(results.partial)}[/]", soft_wrap=True)
    if missed := not_reached(reading):
        console.print(f"[bold yellow]{escape(missed)}[/]", soft_wrap=True)
    for line in _facts(reading):
        console.print(escape(line), soft_wrap=True)
    console.print()
    console.print(escape(reading.answer.lead), soft_wrap=True)
    if reading.events is not None and not reading.events.warns:
        console.print(escape(str(reading.events)), soft_wrap=True)
    for about, words in reading.answer.depends.items():
        console.print(f"{about}: {escape(words)}", style="dim", soft_wrap=True)
    for note in reading.answer.notes:
        console.print(escape(note), style="dim", soft_wrap=True)
    for warning in reading.warnings:
        console.print(f"[yellow]{escape(warning)}[/yellow]", soft_wrap=True)
    for line in plan_lines(reading.plans, reading.cluster):
        console.print(escape(line), soft_wrap=True)
    for cells in reading.cells:
        console.print(f"\n{escape(cells.part)}", style="bold")
        print_table(cells.heads, cells.rows, console, cells.labels)
        if cells.note:
            console.print(escape(cells.note), style="dim", soft_wrap=True)
    tables = ", ".join(results.tables) or "none"
    console.print(
        f"\nTables: {tables} (--table NAME shows one, --columns what they mean)", soft_wrap=True
    )


def show_table(results: Results, name: str, rows: int, console: Console) -> None:
    """Print the first rows of a table.

    Raises:
        ConfigError: no such table.
    """
    frame = results.table(name)
    rows_shown = [
        [plain(values[row]) for values in frame.values()] for row in range(frame.rows)[:rows]
    ]
    print_table(list(frame), rows_shown, console, len(results.factors))
    if frame.rows > rows:
        console.print(f"... and {frame.rows - rows} more rows", soft_wrap=True)


def show_columns(results: Results, tables: Sequence[str], console: Console) -> None:
    """Print the meanings of the columns of some tables, by default of all.

    Raises:
        ConfigError: no such table.
    """
    for index, name in enumerate(tables or results.tables):
        gap = "\n" if index else ""
        console.print(f"{gap}[bold]{escape(name)}[/bold]")
        table = Table(box=None, pad_edge=False, padding=(0, _GAP, 0, 0))
        table.add_column("column", no_wrap=True)
        table.add_column("unit", no_wrap=True)
        table.add_column("meaning", overflow="fold")
        for column in results.columns(name):
            table.add_row(escape(column.name), column.unit, escape(column.meaning))
        console.print(table)


def program(results: Results) -> str:
    """Return the version of the program that made the results."""
    versions = results.manifest.get("versions", {})
    text = f"dva-sim {versions.get('dva-sim')}"
    if commit := versions.get("commit"):
        text += f", commit {commit[:12]}"
    else:
        text += ", commit not known"
    return text + (" with changes that are not committed" if versions.get("dirty") else "")


def print_table(
    heads: Sequence[str], rows: Sequence[Sequence[str]], console: Console, labels: int = 0
) -> None:
    """Print as many columns as fit side by side, and the names of the rest in a line.

    Args:
        heads: Column headings.
        rows: Cells as text.
        console: Output; a file that is not a terminal has room for all columns.
        labels: Number of leading columns that name a row.
    """
    widths = [
        max(map(len, [*head.split(), *(row[n] for row in rows)]), default=0) + _GAP
        for n, head in enumerate(heads)
    ]
    if not console.is_terminal:
        console = Console(file=console.file, width=sum(widths), highlight=False)
    fits = max(
        labels, sum(sum(widths[: n + 1]) - _GAP <= console.width for n in range(len(heads))), 1
    )
    table = Table(box=None, pad_edge=False, padding=(0, _GAP, 0, 0))
    for index, head in enumerate(heads[:fits]):
        numbers = all(
            not row[index] or re.match(r"[-+\u2212\u2013]?(\d|$)", row[index]) for row in rows
        )
        width = widths[index] - _GAP
        is_right = numbers and index >= labels
        table.add_column(escape(head), justify="right" if is_right else "left", width=width)
    for row in rows:
        table.add_row(*(escape(value) for value in row[:fits]))
    console.print(table)
    if fits < len(heads):
        console.print(escape(f"also: {', '.join(heads[fits:])}"), style="dim", soft_wrap=True)


def _facts(reading: Reading) -> Iterator[str]:
    """Yield status, size, program and machine, each in a line."""
    results = reading.results
    manifest = reading.manifest
    study = reading.study
    yield _status(manifest)
    cells = len(manifest.get("cells", []))
    size = f"{runs_of(reading)} runs in {cells} configurations"
    persons = f"{reading.persons} {reading.cluster}s x {study.get('replications')} trials"
    if reading.by_people:
        yield f"1 run in real time, in which people drove, seed {study.get('seed')}"
    else:
        yield f"{size}, {len(results.failures)} failed; {persons}, seed {study.get('seed')}"
    if (stopped := manifest.get("stopped") or {}).get("why"):
        why = _ENDS.get(stopped["why"], stopped["why"])
        yield f"Ended after {stopped['rounds']} of {stopped['of']} rounds: {why}"
    yield f"{program(results)}, study {manifest.get('hash')}"
    if machine := results.machine:
        yield _machine(machine)


def _status(manifest: Mapping[str, Any]) -> str:
    status = status_of(manifest)
    why = "; ".join(status.why)
    return f"Status: {status.kind}{f': {why}' if why else ''}"


def _machine(machine: Mapping[str, Any]) -> str:
    parts = [
        str(machine.get("started", ""))[:16].replace("T", " "),
        str(machine.get("platform", "")),
    ]
    if "cpu_s" in machine:
        parts.append(f"{machine['cpu_s']:.0f} s of CPU time")
    return ", ".join(part for part in parts if part)
