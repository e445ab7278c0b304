"""`python -m dva_sim.emulator`: check the emulated link, or measure conditions of a table."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dva_sim.emulator import console
from dva_sim.emulator.cell import PACKETS, PROXY
from dva_sim.errors import DvaSimError

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False)


@app.command()
def check() -> None:
    """Measure delay, jitter, losses and rate of the emulated link with real packets."""
    raise typer.Exit(console.check())


@app.command()
def measure(
    out: Annotated[Path, typer.Argument(help="CSV file; rows that it holds are not repeated.")],
    like: Annotated[Path, typer.Option(help="CSV table with the conditions to measure.")],
    cells: Annotated[str, typer.Option(help="Only conditions whose name matches this.")] = "",
    runs: Annotated[int, typer.Option(min=1, help="Runs of each condition.")] = 1,
    group: Annotated[str, typer.Option(help="Name of this block of runs.")] = "own",
    link: Annotated[str, typer.Option(help=f"{PACKETS} or {PROXY}.")] = PACKETS,
) -> None:
    """Measure conditions with real programs; can be stopped and taken up again."""
    conditions = console.read_conditions(like, cells)
    raise typer.Exit(console.measure(conditions, runs, out, group, link))


def main() -> None:
    """Run a word of the command line; a mistake is one line."""
    try:
        app()
    except DvaSimError as error:
        console.console.print(str(error), markup=False)
        raise SystemExit(2) from None


if __name__ == "__main__":
    main()
