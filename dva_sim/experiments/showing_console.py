"""What the command line does with results that are there: show, export, compare."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from dva_sim.exit_codes import ExitCode
from dva_sim.experiments import showing
from dva_sim.experiments.results import Results

console = Console(highlight=False)


def show(results: Results, table: str | None, columns: bool, rows: int) -> None:
    """Show what results hold: the answer, a table, or what columns mean."""
    if columns:
        showing.show_columns(results, [] if table is None else [table], console)
    elif table is not None:
        showing.show_table(results, table, rows, console)
    else:
        showing.show(results, console)


def export(
    folder: Path, out: Path, tables: Sequence[str], form: str | None, overwrite: bool
) -> None:
    """Write tables as files."""
    from dva_sim.experiments.exporting import export as write

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
    from dva_sim.experiments.comparing import Comparison
    from dva_sim.experiments.comparing_conditions import parse
    from dva_sim.experiments.comparing_gates import judge
    from dva_sim.experiments.comparing_told import tell, tell_verdicts
    from dva_sim.experiments.results_json import compared

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
