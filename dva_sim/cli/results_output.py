"""What the terminal shows of a results folder: the answer, the cells, a table, or its columns.

What the command line does with results that are there: show, export, compare.

What the terminal says of two results folders side by side.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from dva_sim.experiments.analysis.compare import Comparison, Verdict
from dva_sim.experiments.analysis.compare_rows import Difference, Levels
from dva_sim.experiments.report.sample_size_text import plan_lines
from dva_sim.experiments.results.results import Results, plain
from dva_sim.experiments.study.labels import brief, factor_name, level_name, number
from dva_sim.experiments.study.status import status_of
from dva_sim.kernel.errors import ExitCode
from dva_sim.kernel.units import unit_of

ROWS = 20
_GAP = 2  # between columns
_ENDS = {"enough": "its interval is narrow enough", "budget": "its time is spent"}


def show_results(results: Results, console: Console) -> None:
    """Question, status, answer, warnings, every cell, and where it comes from."""
    console.print(f"[bold]{escape(results.question)}[/bold]", soft_wrap=True)
    if results.partial:
        console.print(f"[bold yellow]{escape(results.partial)}[/]", soft_wrap=True)
    for line in _facts(results):
        console.print(escape(line), soft_wrap=True)
    console.print()
    console.print(escape(results.answer.lead), soft_wrap=True)
    for about, words in results.answer.depends.items():
        console.print(f"{about}: {escape(words)}", style="dim", soft_wrap=True)
    for note in results.answer.notes:
        console.print(escape(note), style="dim", soft_wrap=True)
    for warning in results.reading.warnings:
        console.print(f"[yellow]{escape(warning)}[/yellow]", soft_wrap=True)
    for line in plan_lines(results.reading.plans, results.reading.cluster):
        console.print(escape(line), soft_wrap=True)
    for cells in results.reading.cells:
        console.print(f"\n{escape(cells.part)}", style="bold")
        print_table(cells.heads, cells.rows, console, cells.labels)
        if cells.note:
            console.print(escape(cells.note), style="dim", soft_wrap=True)
    console.print(f"\n{_tables(results)}", soft_wrap=True)


def show_table(results: Results, name: str, rows: int, console: Console) -> None:
    """The first rows of a table.

    Raises:
        ConfigError: no such table.
    """
    frame = results.table(name)
    shown = [[plain(values[row]) for values in frame.values()] for row in range(frame.rows)[:rows]]
    print_table(list(frame), shown, console, len(results.factors))
    if frame.rows > rows:
        console.print(f"... and {frame.rows - rows} more rows", soft_wrap=True)


def show_columns(results: Results, tables: Sequence[str], console: Console) -> None:
    """What the columns of some tables mean, or of all.

    Raises:
        ConfigError: no such table.
    """
    for index, name in enumerate(tables or results.tables):
        gap = "\n" if index else ""
        console.print(f"{gap}[bold]{escape(name)}[/bold]")
        told = Table(box=None, pad_edge=False, padding=(0, _GAP, 0, 0))
        told.add_column("column", no_wrap=True)
        told.add_column("unit", no_wrap=True)
        told.add_column("meaning", overflow="fold")
        for column in results.columns(name):
            told.add_row(escape(column.name), column.unit, escape(column.meaning))
        console.print(told)


def program(results: Results) -> str:
    """Which program made the results."""
    versions = results.manifest.get("versions", {})
    told = f"dva-sim {versions.get('dva-sim')}"
    if commit := versions.get("commit"):
        told += f", commit {commit[:12]}"
    else:
        told += ", commit not known"
    return told + (" with changes that are not committed" if versions.get("dirty") else "")


def print_table(
    heads: Sequence[str], rows: Sequence[Sequence[str]], console: Console, labels: int = 0
) -> None:
    """Columns side by side as far as there is room; the names of the others in a line.

    Args:
        heads: Of the columns.
        rows: As text.
        console: Where to; what is no terminal has room for all.
        labels: How many leading columns name a row.
    """
    widths = [_width(head, [row[n] for row in rows]) for n, head in enumerate(heads)]
    if not console.is_terminal:
        console = Console(file=console.file, width=sum(widths), highlight=False)
    fits = max(
        labels, sum(sum(widths[: n + 1]) - _GAP <= console.width for n in range(len(heads))), 1
    )
    table = Table(box=None, pad_edge=False, padding=(0, _GAP, 0, 0))
    for index, head in enumerate(heads[:fits]):
        numbers = all(_is_number(row[index]) for row in rows)
        width = widths[index] - _GAP
        is_right = numbers and index >= labels
        table.add_column(escape(head), justify="right" if is_right else "left", width=width)
    for row in rows:
        table.add_row(*(escape(value) for value in row[:fits]))
    console.print(table)
    if fits < len(heads):
        console.print(escape(f"also: {', '.join(heads[fits:])}"), style="dim", soft_wrap=True)


def _width(head: str, values: Sequence[str]) -> int:
    return max(map(len, [*head.split(), *values]), default=0) + _GAP


def _is_number(text: str) -> bool:
    return not text or re.match(r"[-+\u2212\u2013]?(\d|$)", text) is not None


def _facts(results: Results) -> Iterator[str]:
    """Status, size, program and machine, each in a line."""
    manifest, study = results.manifest, results.study
    yield _status(manifest)
    cells = len(manifest.get("cells", []))
    size = f"{results.runs.rows} runs in {cells} configurations"
    persons = (
        f"{results.reading.persons} {results.reading.cluster}s x {study.get('replications')} trials"
    )
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


def _tables(results: Results) -> str:
    names = ", ".join(results.tables) or "none"
    return f"Tables: {names} (--table NAME shows one, --columns what they mean)"


console = Console(highlight=False)


def show(results: Results, table: str | None, columns: bool, rows: int) -> None:
    """Show what results hold: the answer, a table, or what columns mean."""
    if columns:
        show_columns(results, [] if table is None else [table], console)
    elif table is not None:
        show_table(results, table, rows, console)
    else:
        show_results(results, console)


def export(
    folder: Path, out: Path, tables: Sequence[str], form: str | None, overwrite: bool
) -> None:
    """Write tables as files."""
    from dva_sim.experiments.results.export import export as write

    for path in write(Results.load(folder), out, tables, form, overwrite):
        console.print(str(path), soft_wrap=True, markup=False)


@dataclass(frozen=True)
class Asked:
    """What is asked of two results folders.

    Attributes:
        measures: `NAME` or `TABLE.NAME`; none for that of the answer.
        by: Factors for whose levels cells are taken together.
        fail_if: Conditions that should not hold.
    """

    measures: Sequence[str] = ()
    by: Sequence[str] = ()
    fail_if: Sequence[str] = ()


def compare(
    first: Path,
    second: Path,
    asked: Asked,
    tell_data: Callable[[dict[str, Any]], object] | None = None,
) -> ExitCode:
    """Compare two results folders; how it ended, by whether a condition holds.

    Args:
        first: What is compared with.
        second: What is compared.
        asked: By which measures, where, and what should not be.
        tell_data: Takes what came out as plain data, instead of the terminal.
    """
    from dva_sim.cli.results_json import compared
    from dva_sim.experiments.analysis.compare import Comparison, judge
    from dva_sim.experiments.analysis.fail_conditions import parse

    gates = [parse(text) for text in asked.fail_if]
    comparison = Comparison(Results.load(first), Results.load(second))
    verdicts = [verdict for gate in gates for verdict in judge(gate, comparison)]
    if tell_data is not None:
        tell_data(compared(comparison, asked.measures, asked.by, verdicts))
    else:
        tell(comparison, asked.measures, asked.by, console)
        tell_verdicts(verdicts, console)
    has_failed = any(verdict.holds for verdict in verdicts)
    return ExitCode.GATE_FAILED if has_failed else ExitCode.OK


_SHOWN = 12  # names in a line
_MARK = "*"


def tell(
    comparison: Comparison, measures: Sequence[str], by: Sequence[str], console: Console
) -> None:
    """Which folders, which cells, and how each measure differs.

    Args:
        comparison: Of the two folders.
        measures: Which; none for that of the declared answer.
        by: Factors for whose levels cells are taken together; none for every cell.
        console: Where to.

    Raises:
        ConfigError: no such measure or factor.
    """
    for name, side in zip("AB", comparison.sides, strict=True):
        console.print(escape(f"{name}: {side.folder}: {program(side)}{_set(side)}"), soft_wrap=True)
        if side.failures:
            failed = f"{len(side.failures)} runs of {name} failed and take no part"
            console.print(failed, style="yellow", soft_wrap=True)
    for line in (*_questions(comparison), *_cells(comparison), _luck(comparison)):
        console.print(escape(line), soft_wrap=True)
    wanted: Sequence[str | None] = measures or [None]
    for measure in wanted:
        table, column = comparison.find(measure)
        name = column if table == "runs" else f"{table}.{column}"
        _differences(name, comparison.differences(f"{table}.{column}", by), console)
    console.print(f"\n{escape(_changed(comparison))}", soft_wrap=True)


def tell_verdicts(verdicts: Iterable[Verdict], console: Console) -> None:
    """Say of each condition where it holds."""
    for _, group in groupby(verdicts, key=lambda verdict: verdict.gate.text):
        each = list(group)
        worst = [verdict for verdict in each if verdict.holds]
        word = "[red]failed[/red]" if worst else "passed"
        console.print(f"{word}: {escape(each[0].gate.text)}", soft_wrap=True)
        for verdict in worst or each:
            console.print(f"  {escape(_verdict(verdict))}", soft_wrap=True)


def _verdict(verdict: Verdict) -> str:
    where = ", ".join(filter(None, (verdict.part, brief(dict(verdict.levels)))))
    values = f"A {verdict.first:.5g}, B {verdict.second:.5g}, bound {verdict.bound:.5g}"
    here, there = verdict.missing
    if here == there:
        return f"{where}: {values}"
    return f"{where}: {values}; without a value: A {100 * here:.3g} %, B {100 * there:.3g} %"


def _set(side: Results) -> str:
    changed = ", ".join(map(str, side.manifest.get("set", ())))
    return f", --set {changed}" if changed else ""


def _questions(comparison: Comparison) -> list[str]:
    """What two studies ask, if it is not the same."""
    asked = [side.question for side in comparison.sides]
    if asked[0] == asked[1]:
        return []
    return ["Two different studies:", *(f"  {n}: {q}" for n, q in zip("AB", asked, strict=True))]


def _cells(comparison: Comparison) -> list[str]:
    matched = comparison.matched
    others = sum(not pair.is_same for pair in matched.pairs)
    more = f", {others} of them with another configuration in each" if others else ""
    lines = [f"{len(matched.pairs)} cells are in both{more}"]
    for name, rest in (("A", matched.only_first), ("B", matched.only_second)):
        if rest:
            some = "; ".join(f"{part} {brief(dict(levels))}" for part, levels in rest[:_SHOWN])
            more = f"; and {len(rest) - _SHOWN} more" if len(rest) > _SHOWN else ""
            lines.append(f"only in {name}: {some}{more}")
    for factor, (here, there) in matched.differing.items():
        sides = [", ".join(level_name(factor, x) for x in side) or "-" for side in (here, there)]
        lines.append(f"{factor_name(factor)} differs: A {sides[0]}, B {sides[1]}")
    return lines


def _luck(comparison: Comparison) -> str:
    pairs, runs = comparison.paired
    if not pairs:
        return "No run of both has the same random seed: persons are compared with other persons"
    share = "all" if pairs == runs else f"{pairs} of {runs}"
    return f"Compared in pairs of the same person, trial and seed: {share} runs of A"


def _differences(name: str, found: Sequence[Difference], console: Console) -> None:
    unit = f" [{unit_of(name)}]" if unit_of(name) else ""
    console.print(f"\n[bold]{escape(f'{name}{unit}')}[/bold]")
    factors = list(dict.fromkeys(factor for row in found for factor, _ in row.levels))
    heads = ["part", *map(factor_name, factors), "runs A", "runs B", "median A", "median B"]
    rows = [[row.part, *_names(row.levels, factors), *_numbers(row)] for row in found]
    print_table([*heads, "B - A, mean (95 % interval)"], rows, console, 1 + len(factors))
    told = sum(row.is_told_from_zero for row in found)
    if told:
        console.print(
            f"{_MARK} leaves out zero, each interval for itself: {told} of {len(found)}; of "
            "those that did not change, one in 20 would by chance",
            style="dim",
            soft_wrap=True,
        )


def _names(levels: Levels, factors: Sequence[str]) -> list[str]:
    given = dict(levels)
    return [level_name(factor, given[factor]) if factor in given else "" for factor in factors]


def _numbers(row: Difference) -> list[str]:
    return [*map(str, row.runs), *map(number, row.medians), _interval(row)]


def _interval(row: Difference) -> str:
    if row.is_identical:
        return "identical"
    mark = f" {_MARK}" if row.is_told_from_zero else ""
    of = row.interval
    return f"{number(of.mean)} ({number(of.low)} to {number(of.high)}){mark}"


def _changed(comparison: Comparison) -> str:
    if not comparison.paired[0]:
        return ""
    changed, every = comparison.changed()
    if not changed:
        return f"All {every} measures are the same in every pair of runs"
    more = f" and {len(changed) - _SHOWN} more" if len(changed) > _SHOWN else ""
    return f"{len(changed)} of {every} measures changed: {', '.join(changed[:_SHOWN])}{more}"
