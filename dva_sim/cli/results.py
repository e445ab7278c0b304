"""The commands that read results: report, show, export, compare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from dva_sim.cli.options import Json, Overwrite, Quiet, ResultsFolder, Verbose, count
from dva_sim.cli.verbosity import WRITTEN, loudness, print_json, tell_files


def report(
    folder: ResultsFolder,
    pdf: Annotated[bool, Option("--pdf", help="As PDF too, for print.")] = False,
    figure: Annotated[
        list[str] | None,
        Option("--figure", metavar="FILE:CLASS", help="With a figure of one's own; repeatable."),
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Make the report of a results folder again.

    It is a page, its figures, and the numbers in them. Of a study that still runs, the page
    says what is known so far. Figures of one's own, which a study names in its file, are drawn
    when it is run; afterwards they are drawn where --figure names them.

    Examples:
        dva-sim report results/req-rep-vs-pub-sub --pdf  # and report.pdf for print
        dva-sim report small --figure risk.py:Risk  # with a figure of one's own
    """
    from dva_sim.experiments.report.figures.registry import load_figures  # late: start-up
    from dva_sim.experiments.report.report import write_report  # late: start-up

    with loudness(quiet, verbose):
        page = write_report(folder, pdf, figures=load_figures(figure or ()))
        tell_files(folder, *WRITTEN)
        typer.echo(f"Report: {page}{' and report.pdf' if pdf else ''}")


def show(
    folder: ResultsFolder,
    table: Annotated[str | None, Option(metavar="NAME", help="Show the rows of a table.")] = None,
    rows: Annotated[int, count("How many of them.", least=1)] = 20,
    columns: Annotated[
        bool, Option("--columns", help="Say what the columns mean, of one table or all.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Show a results folder in the terminal.

    It shows the answer and every cell, or a table, or what the columns mean. Of a study that
    still runs it shows what is known so far.

    Examples:
        dva-sim show small  # the answer and every cell
        dva-sim show small --table events --rows 5  # the first rows of a table
        dva-sim show small --columns  # what the columns of every table mean
        dva-sim show small --json  # the same for other programs
    """
    from dva_sim.cli import results_json  # late: start-up
    from dva_sim.experiments.execution.checkpoint import load_so_far  # late: start-up
    from dva_sim.experiments.report import terminal  # late: start-up

    results = load_so_far(folder)
    if not as_json:
        terminal.show(results, table, columns, rows)
    elif columns:
        print_json(results_json.columns(results, [] if table is None else [table]))
    else:
        print_json(
            results_json.shown(results)
            if table is None
            else results_json.table(results, table, rows)
        )


def export(
    folder: ResultsFolder,
    out: Annotated[
        Path,
        Option(
            "-o", "--out", metavar="PATH", help="X.csv or X.parquet for one table, or a folder."
        ),
    ],
    table: Annotated[
        list[str] | None,
        Option(metavar="NAME", help="Only this one; may be given again."),
    ] = None,
    form: Annotated[
        str | None, Option("--format", metavar="csv|parquet", help="In a folder; default: csv.")
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Write tables of results for other programs.

    In a folder, columns.csv says what the columns mean.

    Examples:
        dva-sim export small -o small.csv  # one row for each run
        dva-sim export small -o tables --format parquet  # every table
    """
    from dva_sim.experiments.results.export import export as write  # late: start-up
    from dva_sim.experiments.results.results import Results  # late: start-up

    for path in write(Results.load(folder), out, table or [], form, overwrite):
        print(path)


def compare(
    first: Annotated[Path, Argument(metavar="A", help="A results folder.")],
    second: Annotated[Path, Argument(metavar="B", help="What is compared with it.")],
    measure: Annotated[
        list[str] | None,
        Option(
            metavar="MEASURE",
            help="NAME or TABLE.NAME; default: the answer's. May be given again.",
        ),
    ] = None,
    by: Annotated[
        list[str] | None,
        Option(metavar="FACTOR", help="Its levels in place of cells; may be given again."),
    ] = None,
    fail_if: Annotated[
        list[str] | None,
        Option(metavar="CONDITION", help="Exit with 4 if it holds; may be given again."),
    ] = None,
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
        first,
        second,
        measures=measure or [],
        by=by or [],
        fail_if=fail_if or [],
        as_json=as_json,
    )
    raise typer.Exit(code)
