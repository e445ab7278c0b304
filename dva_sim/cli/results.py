"""The commands that read results: report, show, export, compare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dva_sim.cli.options import Json, Quiet, Verbose
from dva_sim.cli.verbosity import WRITTEN, loudness, print_json, tell_files
from dva_sim.options.forms import OptionForm
from dva_sim.options.studies import CompareOptions, ExportOptions, ReportOptions, ShowOptions


def report(options: ReportOptions, quiet: Quiet = False, verbose: Verbose = False) -> None:
    """Rebuild the report of a results folder.

    A report is a page, its figures and the numbers behind them. While a study is running, the page
    shows the results so far.

    Examples:
        dva-sim report results/req-rep-vs-pub-sub --pdf  # and report.pdf for print
    """
    from dva_sim.experiments.report.report import write_report  # late: start-up

    with loudness(quiet, verbose):
        page = write_report(Path(str(options.folder)), options.pdf)
        tell_files(page.parent, *WRITTEN)
        typer.echo(f"Report: {page}{' and report.pdf' if options.pdf else ''}")


def show(options: ShowOptions, as_json: Json = False) -> None:
    """Show a results folder in the terminal.

    Shows the answer and every cell, or a table, or the meaning of the columns. While a study is
    running, it shows the results so far.

    Examples:
        dva-sim show small  # the answer and every cell
        dva-sim show small --table events --rows 5  # the first rows of a table
        dva-sim show small --columns  # what the columns of every table mean
        dva-sim show small --json  # the same for other programs
    """
    from dva_sim.experiments.execution.checkpoint import load_so_far  # late: start-up

    results = load_so_far(str(options.folder))
    table = options.table
    if not as_json:
        from dva_sim.experiments.report import terminal  # late: start-up

        terminal.show(results, table, options.columns, options.rows)
        return
    from dva_sim.cli import results_json  # late: start-up

    if options.columns:
        print_json(results_json.columns(results, [] if table is None else [table]))
    else:
        print_json(
            results_json.shown(results)
            if table is None
            else results_json.table(results, table, options.rows)
        )


def export(options: ExportOptions) -> None:
    """Write tables of results for other programs.

    In a folder, columns.csv says what the columns mean.

    Examples:
        dva-sim export small -o small.csv  # one row for each run
        dva-sim export small -o tables --format parquet  # every table
    """
    from dva_sim import api  # late: start-up

    for path in api.export(**vars(options)):
        print(path)


def compare(
    options: CompareOptions,
    measure: Annotated[
        tuple[str, ...],
        OptionForm(
            "NAME or TABLE.NAME; default: the answer's. May be given again.",
            metavar="MEASURE",
            is_repeated=True,
        ),
    ] = (),
    by: Annotated[
        tuple[str, ...],
        OptionForm(
            "Compare by the levels of this factor instead of by cell; may be given again.",
            metavar="FACTOR",
            is_repeated=True,
        ),
    ] = (),
    fail_if: Annotated[
        tuple[str, ...],
        OptionForm(
            "Exit with 4 if it holds; may be given again.", metavar="CONDITION", is_repeated=True
        ),
    ] = (),
    as_json: Json = False,
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

    code = comparison.compare(
        Path(str(options.first)),
        Path(str(options.second)),
        measures=measure,
        by=by,
        fail_if=fail_if,
        as_json=as_json,
    )
    raise typer.Exit(code)
