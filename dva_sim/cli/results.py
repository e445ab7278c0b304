"""The commands that read results: report, show, export, compare."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from dva_sim import api
from dva_sim.cli.options import Json, Quiet, Verbose, asks, several, takes
from dva_sim.cli.verbosity import WRITTEN, loudness, print_json, tell_files


@takes(api.report)
def report(
    folder: str, pdf: bool, quiet: Quiet = False, verbose: Verbose = False, **asked: Any
) -> None:
    """Rebuild the report of a results folder.

    A report is a page, its figures and the numbers behind them. While a study is running, the page
    shows the results so far. Your own figures, named in the study's file, are drawn when the study
    is run; later they are drawn only if --figure names them.

    Examples:
        dva-sim report results/req-rep-vs-pub-sub --pdf  # and report.pdf for print
        dva-sim report small --figure risk.py:Risk  # with a figure of your own
    """
    with loudness(quiet, verbose):
        page = api.report(folder, pdf=pdf, **asked)
        tell_files(page.parent, *WRITTEN)
        typer.echo(f"Report: {page}{' and report.pdf' if pdf else ''}")


@takes(api.show)
def show(folder: str, table: str | None, rows: int, columns: bool, as_json: Json = False) -> None:
    """Show a results folder in the terminal.

    Shows the answer and every cell, or a table, or the meaning of the columns. While a study is
    running, it shows the results so far.

    Examples:
        dva-sim show small  # the answer and every cell
        dva-sim show small --table events --rows 5  # the first rows of a table
        dva-sim show small --columns  # what the columns of every table mean
        dva-sim show small --json  # the same for other programs
    """
    if not as_json:
        api.show(folder, table=table, rows=rows, columns=columns)
        return
    from dva_sim.cli import results_json  # late: start-up
    from dva_sim.experiments.execution.checkpoint import load_so_far  # late: start-up

    results = load_so_far(folder)
    if columns:
        print_json(results_json.columns(results, [] if table is None else [table]))
    else:
        print_json(
            results_json.shown(results)
            if table is None
            else results_json.table(results, table, rows)
        )


@takes(api.export)
def export(**asked: Any) -> None:
    """Write tables of results for other programs.

    In a folder, columns.csv says what the columns mean.

    Examples:
        dva-sim export small -o small.csv  # one row for each run
        dva-sim export small -o tables --format parquet  # every table
    """
    for path in api.export(**asked):
        print(path)


@takes(api.compare)
@asks(
    measure=(
        several("NAME or TABLE.NAME; default: the answer's. May be given again.", "MEASURE"),
        (),
    ),
    by=(
        several(
            "Compare by the levels of this factor instead of by cell; may be given again.", "FACTOR"
        ),
        (),
    ),
    fail_if=(several("Exit with 4 if it holds; may be given again.", "CONDITION"), ()),
)
def compare(
    first: str, second: str, measure: list[str], as_json: Json = False, **asked: Any
) -> None:
    """Compare two results folders, run by run.

    Runs with the same random seed are compared in pairs.

    Examples:
        dva-sim compare before after --by pattern  # by the levels of a factor
        dva-sim compare a b --fail-if 'p95(drive_time_s) > 1.05x'  # B's over A's
        dva-sim compare a b --fail-if 'mean(drive_time_s) per cell > +0.5 s'  # B minus A
        dva-sim compare a b --fail-if 'share(confirmed) < 95 %'  # of B alone
    """
    from dva_sim.cli import comparison  # late: start-up

    code = comparison.compare(Path(first), Path(second), measures=measure, as_json=as_json, **asked)
    raise typer.Exit(code)
