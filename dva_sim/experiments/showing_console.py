"""What the command line does with results that are there: show, export, compare."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

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


def compare(
    first: Path, second: Path, measures: Sequence[str], by: Sequence[str], fail_if: Sequence[str]
) -> ExitCode:
    """Compare two results folders; how it ended, by whether a condition holds."""
    from dva_sim.experiments.comparing import Comparison
    from dva_sim.experiments.comparing_conditions import parse
    from dva_sim.experiments.comparing_gates import judge
    from dva_sim.experiments.comparing_told import tell, tell_verdicts

    gates = [parse(text) for text in fail_if]
    comparison = Comparison(Results.load(first), Results.load(second))
    verdicts = [verdict for gate in gates for verdict in judge(gate, comparison)]
    tell(comparison, measures, by, console)
    return ExitCode.GATE_FAILED if tell_verdicts(verdicts, console) else ExitCode.OK
