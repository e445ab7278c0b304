"""The command that puts load on a DVA."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import asdict, fields
from functools import partial
from typing import TYPE_CHECKING, Any

import typer

from dva_sim.cli.options import Json, Quiet
from dva_sim.cli.verbosity import print_json
from dva_sim.kernel.errors import ConfigError, ExitCode
from dva_sim.kernel.whole_files import write_whole
from dva_sim.options.runs import LoadOptions

if TYPE_CHECKING:
    from dva_sim.live.load import LoadFigures
    from dva_sim.live.load_devices import LoadShare

DECIMALS = 6  # decimals of a figure


def load(options: LoadOptions, quiet: Quiet = False, as_json: Json = False) -> None:
    """Put load on a DVA: devices, sessions, events.

    Measures replies of the DVA, commands and emergencies between devices, and the time from a
    report to an order. The exit code is 1 if the DVA breaks and --until-it-breaks is not given.

    Examples:
        dva-sim load --devices 500 --sessions 50  # a DVA that is started for it
        dva-sim load --dva 192.168.1.10:5600 --host 192.168.1.20  # a DVA elsewhere
        dva-sim load --until-it-breaks --for 20 -o load.csv  # twice as many each time
    """
    from dva_sim.kernel.resources import refuse_to_replace  # late: start-up
    from dva_sim.live.load import run_load  # late: start-up

    out = options.out
    if out is not None:
        if out.suffix != ".csv":
            raise ConfigError(f"{out} should end in .csv")
        refuse_to_replace([out], options.overwrite)
    steps = []
    make = None if options.scheduler is None else partial(_make_on_cluster, options.scheduler)
    for figures in run_load(options, make):
        steps.append(figures)
        if not (quiet or as_json):
            for line in lines(figures):
                typer.echo(line)
        if out is not None:
            write_whole(out, table(steps))
    if as_json:
        print_json([asdict(figures) for figures in steps])
    if steps[-1].broke and not options.until_it_breaks:
        raise typer.Exit(ExitCode.DOES_NOT_HOLD)


def _make_on_cluster(scheduler: str, shares: list[LoadShare]) -> list[dict[str, Any]]:
    """Make the shares of a load on a cluster, one on each worker; return the counts of each.

    Clocks of machines are apart, so no time from a report here to an order there is known.
    """
    from dva_sim.experiments.execution.dask_cluster import DaskCluster  # late: start-up
    from dva_sim.live.load_devices import make  # late: start-up

    with DaskCluster(scheduler) as workers, workers.executor(len(shares), make) as executor:
        workers.wait_for(len(shares))
        futures = [executor.submit(workers.guarded(make), share) for share in shares]
        return [future.result() | {"ordered": []} for future in futures]


def lines(figures: LoadFigures) -> list[str]:
    """Describe the figures of one step."""
    row = asdict(figures)
    texts = [
        f"{figures.joined} of {figures.devices} devices, {figures.sessions} sessions: "
        f"{figures.messages_per_s:.0f} messages a second, {figures.refused} refused, "
        f"{figures.lost} lost"
    ]
    for name in ("requests", "commands", "emergencies", "orders"):
        times = [row[f"{name}_p{word}_s"] for word in ("50", "99", "999")]
        if not math.isnan(times[0]):
            p50, p99, p999 = (f"{1000 * time:.1f}" for time in times)
            texts.append(f"  {name}: p50 {p50}, p99 {p99}, p99.9 {p999} ms")
    if not math.isnan(figures.memory_mb):
        texts.append(
            f"  DVA: {figures.memory_mb:.0f} MB, {figures.files:.0f} open files, "
            f"{100 * figures.processor:.0f} % of a core"
        )
    texts.append(f"  load: late by at most {1000 * figures.late_s:.0f} ms")
    return [*texts, *([f"  broken: {figures.broke}"] if figures.broke else [])]


def _cell(value: object) -> object:
    if not isinstance(value, float):
        return value
    return "" if math.isnan(value) else round(value, DECIMALS)


def table(steps: list[LoadFigures]) -> str:
    """Return the figures as CSV, a row for each step, with empty cells for unknown figures."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow([field.name for field in fields(steps[0])])
    for figures in steps:
        rows.writerow(map(_cell, vars(figures).values()))
    return text.getvalue()
