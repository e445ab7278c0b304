"""`dva-sim compare`: the differences of two results folders, and the verdict of a gate."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from dva_sim.cli.console import console, print_lines
from dva_sim.cli.results_json import compared
from dva_sim.cli.verbosity import print_json
from dva_sim.experiments.analysis.compare import Comparison
from dva_sim.experiments.analysis.fail_conditions import GateVerdict, judge, parse
from dva_sim.experiments.analysis.matched_results import Difference, Levels
from dva_sim.experiments.execution.kept_run import complete
from dva_sim.experiments.report.terminal import print_table, program
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ExitCode
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import number
from dva_sim.simulation.labels import brief, factor_name, level_name


def compare(
    first: Path,
    second: Path,
    *,
    measures: Sequence[str] = (),
    by: Sequence[str] = (),
    fail_if: Sequence[str] = (),
    as_json: bool = False,
) -> ExitCode:
    """Compare two results folders; how it ended, by whether a condition holds.

    Args:
        first: Results to compare with.
        second: Results to compare.
        measures: `NAME` or `TABLE.NAME`; none for that of the answer.
        by: Factors for whose levels cells are taken together.
        fail_if: Conditions that should not hold.
        as_json: Print it as JSON.

    Raises:
        ConfigError: one is no results folder, or there is no such measure, factor or condition.
    """
    gates = [parse(text) for text in fail_if]
    for folder in (first, second):
        complete(folder)
    comparison = Comparison(Results.load(first), Results.load(second))
    verdicts = [verdict for gate in gates for verdict in judge(gate, comparison)]
    if as_json:
        print_json(compared(comparison, measures, by, verdicts))
    else:
        tell(comparison, measures, by, console)
        tell_verdicts(verdicts, console)
    has_failed = any(verdict.holds for verdict in verdicts)
    return ExitCode.GATE_FAILED if has_failed else ExitCode.OK


_SHOWN = 12  # maximum names in a line
_MARK = "*"


def tell(
    comparison: Comparison, measures: Sequence[str], by: Sequence[str], console: Console
) -> None:
    """Print which folders and cells are compared, and how each measure differs.

    Args:
        measures: Measures to compare; by default that of the declared answer.
        by: Factors for whose levels cells are taken together; none for every cell.

    Raises:
        ConfigError: no such measure or factor.
    """
    for name, side in zip("AB", comparison.sides, strict=True):
        changed = ", ".join(map(str, side.manifest.get("set", ())))
        line = f"{name}: {side.folder}: {program(side)}" + (changed and f", --set {changed}")
        console.print(escape(line), soft_wrap=True)
        if side.failures:
            failed = f"{len(side.failures)} runs of {name} failed and take no part"
            console.print(failed, style="yellow", soft_wrap=True)
    lines = (*_questions(comparison), *_cells(comparison), _random_numbers(comparison))
    print_lines(map(escape, lines), console)
    names: Sequence[str | None] = measures or [None]
    for measure in names:
        table, column = comparison.find(measure)
        name = column if table == "runs" else f"{table}.{column}"
        _differences(name, comparison.differences(f"{table}.{column}", by), console)
    console.print(f"\n{escape(_changed(comparison))}", soft_wrap=True)


def tell_verdicts(verdicts: Iterable[GateVerdict], console: Console) -> None:
    """Say of each condition where it holds."""
    for _, group in groupby(verdicts, key=lambda verdict: verdict.gate.text):
        each = list(group)
        worst = [verdict for verdict in each if verdict.holds]
        word = "[red]failed[/red]" if worst else "passed"
        console.print(f"{word}: {escape(each[0].gate.text)}", soft_wrap=True)
        print_lines((f"  {escape(_verdict(verdict))}" for verdict in worst or each), console)


def _verdict(verdict: GateVerdict) -> str:
    where = ", ".join(filter(None, (verdict.part, brief(dict(verdict.levels)))))
    values = f"A {verdict.first:.5g}, B {verdict.second:.5g}, bound {verdict.bound:.5g}"
    missing_a, missing_b = verdict.missing
    if missing_a == missing_b:
        return f"{where}: {values}"
    return (
        f"{where}: {values}; without a value: A {100 * missing_a:.3g} %, B {100 * missing_b:.3g} %"
    )


def _questions(comparison: Comparison) -> list[str]:
    """Return the questions of two studies, if they differ."""
    questions = [side.question for side in comparison.sides]
    if questions[0] == questions[1]:
        return []
    return [
        "Two different studies:",
        *(f"  {n}: {q}" for n, q in zip("AB", questions, strict=True)),
    ]


def _cells(comparison: Comparison) -> list[str]:
    matched = comparison.matched
    reconfigured = sum(not pair.is_same for pair in matched.pairs)
    more = f", {reconfigured} of them with another configuration in each" if reconfigured else ""
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


def _random_numbers(comparison: Comparison) -> str:
    pairs, runs = comparison.paired
    if not pairs:
        return "A and B share no random seed, so different persons are compared"
    share = "all" if pairs == runs else f"{pairs} of {runs}"
    return f"Compared in pairs of the same person, trial and seed: {share} runs of A"


def _differences(name: str, differences: Sequence[Difference], console: Console) -> None:
    unit = f" [{unit_of(name)}]" if unit_of(name) else ""
    console.print(f"\n[bold]{escape(f'{name}{unit}')}[/bold]")
    factors = list(dict.fromkeys(factor for row in differences for factor, _ in row.levels))
    heads = ["part", *map(factor_name, factors), "runs A", "runs B", "median A", "median B"]
    rows = [[row.part, *_names(row.levels, factors), *_numbers(row)] for row in differences]
    print_table([*heads, "B - A, mean (95 % interval)"], rows, console, 1 + len(factors))
    if not all(row.is_identical for row in differences):
        text = "B - A is the mean over persons, not the difference of the medians beside it"
        console.print(text, style="dim", soft_wrap=True)
    clear = sum(row.differs_from_zero for row in differences)
    if clear:
        console.print(
            f"{_MARK} excludes zero, each interval on its own: {clear} of {len(differences)}; of "
            "those that did not change, one in 20 would by chance",
            style="dim",
            soft_wrap=True,
        )


def _names(levels: Levels, factors: Sequence[str]) -> list[str]:
    level_by_factor = dict(levels)
    return [
        level_name(factor, level_by_factor[factor]) if factor in level_by_factor else ""
        for factor in factors
    ]


def _numbers(row: Difference) -> list[str]:
    return [*map(str, row.runs), *map(number, row.medians), _interval(row)]


def _interval(row: Difference) -> str:
    if row.is_identical:
        return "identical"
    mark = f" {_MARK}" if row.differs_from_zero else ""
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
