"""`python -m dva_sim.emulator`: check the emulated link, or measure conditions of a table."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from dva_sim.emulator.campaign import Progress, measure_all
from dva_sim.emulator.cell import PACKETS, PROXY
from dva_sim.emulator.check import check_link
from dva_sim.emulator.running import why_no_packets
from dva_sim.errors import ConfigError, DvaSimError
from dva_sim.network.condition import Condition

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False)
console = Console(highlight=False, soft_wrap=True)
_OFFER = f"`measure --link {PROXY}` measures over a relay of TCP instead, without loss"


@app.command()
def check(
    rootless: Annotated[
        bool, typer.Option("--rootless", help="A user namespace, also for root.")
    ] = False,
) -> None:
    """Measure delay, jitter, losses and rate of the emulated link with real packets."""
    _explain_missing()
    findings = check_link(rootless)
    for finding in findings:
        console.print(str(finding), markup=False)
    raise typer.Exit(0 if all(finding.passed for finding in findings) else 1)


@app.command()
def measure(
    out: Annotated[Path, typer.Argument(help="CSV file; rows that it holds are not repeated.")],
    like: Annotated[Path, typer.Option(help="CSV table with the conditions to measure.")],
    cells: Annotated[str, typer.Option(help="Only conditions whose name matches this.")] = "",
    seeds: Annotated[int, typer.Option(min=1, help="Runs of each condition.")] = 1,
    group: Annotated[str, typer.Option(help="Name of this block of runs.")] = "own",
    link: Annotated[str, typer.Option(help=f"{PACKETS} or {PROXY}.")] = PACKETS,
) -> None:
    """Measure conditions with real programs; can be stopped and taken up again."""
    if link not in (PACKETS, PROXY):
        raise ConfigError(f"link {link!r} is unknown; known: {PACKETS}, {PROXY}")
    if link == PACKETS:
        _explain_missing()
    conditions = read_conditions(like, cells)
    failures = measure_all(conditions, range(1, seeds + 1), out, _tell, group, link)
    for failure in failures:
        console.print(failure, markup=False)
    raise typer.Exit(1 if failures else 0)


def read_conditions(table: Path, cells: str = "") -> list[Condition]:
    """The different conditions of a table, in its order.

    Args:
        table: CSV file with the columns of conditions.
        cells: Only those whose label matches this regular expression.

    Raises:
        ConfigError: the table cannot be read, or nothing matches.
    """
    try:
        with table.open(encoding="utf-8", newline="") as file:
            found = dict.fromkeys(Condition.from_row(row) for row in csv.DictReader(file))
    except (OSError, UnicodeDecodeError, TypeError) as error:
        raise ConfigError(f"is no table of conditions: {error}", table) from None
    conditions = [condition for condition in found if re.search(cells, condition.label)]
    if not conditions:
        raise ConfigError(f"has no condition that matches {cells!r}", table)
    return conditions


def _explain_missing() -> None:
    why = why_no_packets()
    if why:
        raise DvaSimError(f"{why}; {_OFFER}")


def _tell(progress: Progress) -> None:
    words = f"{progress.done}/{progress.total}, {progress.left_s / 60:.0f} min left"
    last = " ".join(filter(None, (progress.cell, progress.problem)))
    console.print(f"{words}  {last}", markup=False)


def main() -> None:
    """Run a word of the command line; a mistake is one line."""
    try:
        app()
    except DvaSimError as error:
        console.print(str(error), markup=False)
        raise SystemExit(2) from None


if __name__ == "__main__":
    main()
