"""What the command line does with a validation of dispatch: play, tell, write."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from dva_sim.kernel.errors import ExitCode
from dva_sim.validation.dispatch import result_page
from dva_sim.validation.dispatch.cases import SHIPPED, Case, load_cases
from dva_sim.validation.dispatch.identities import IDENTITIES
from dva_sim.validation.dispatch.play import Check, check_cases, check_identities, runs_of
from dva_sim.validation.frame import WIDTH, console, progress_bar, say

TOLD = {
    "input": "checks of what the scenarios put in agree",
    "identity": "identities hold (Little's law, conservation, scaling, the oracle, ...)",
}
STYLES = {"agrees": "green", "too rough": "yellow", "differs": "bold red"}


def validate_dispatch(
    cases: str | None, out: Path | None, quick: bool, jobs: int, seed: int
) -> ExitCode:
    """Play every case, print the comparison, write it if asked to; how it ended.

    Raises:
        ConfigError: a mistake in the cases.
    """
    started = time.perf_counter()
    played = load_cases(cases or SHIPPED)
    checks = _play(played, seed, quick, jobs)
    _tell(checks, quick)
    say(f"{time.perf_counter() - started:.0f} s")
    if out is not None:
        conditions = {
            "cases": f"{cases or SHIPPED} ({len(played)})",
            "events played": f"{_events(checks):,}",
            "seed": str(seed),
            "length": "quick" if quick else "full",
        }
        say(f"Report: {result_page.write(out, checks, conditions)}")
    missed = any(c.verdict == "differs" or _too_rough(c, quick) for c in checks)
    return ExitCode.GATE_FAILED if missed else ExitCode.OK


def _too_rough(check: Check, quick: bool) -> bool:
    """A full run is to be as sharp as it promises."""
    return check.verdict == "too rough" and not quick


def _play(cases: Sequence[Case], seed: int, quick: bool, workers: int) -> list[Check]:
    with progress_bar() as bar:
        first = len(IDENTITIES)
        task = bar.add_task("identities", total=first + runs_of(cases, quick))
        checks = check_identities(seed, lambda n: bar.update(task, completed=n))
        bar.update(task, description="cases")
        checks += check_cases(
            cases, seed, quick, workers, lambda n: bar.update(task, completed=first + n)
        )
    return checks


def _tell(checks: Sequence[Check], quick: bool) -> None:
    """The table of results, and of everything else that differs."""
    table = Table(box=None, pad_edge=False)
    table.add_column("case", no_wrap=True)
    for head in result_page.HEADS:
        side: Literal["left", "right"] = "left" if head in ("measure", "verdict") else "right"
        table.add_column(head, justify=side, no_wrap=True)
    last = ""
    for check in checks:
        if check.kind != "result" and check.verdict == "agrees":
            continue
        *cells, verdict = result_page.words(check)
        shown = f"[{STYLES[verdict]}]{verdict}[/]"
        table.add_row(escape(check.case) if check.case != last else "", *map(escape, cells), shown)
        last = check.case
    # A narrow terminal breaks its lines; better than numbers that are cut off.
    Console(highlight=False, width=max(console.width, WIDTH)).print(table)
    for kind, told in TOLD.items():
        count = sum(c.kind == kind and c.verdict == "agrees" for c in checks)
        say(f"{count} {told}")
    say(f"[bold]{result_page.headline(checks)}[/bold]")
    for note in result_page.notes(checks, quick):
        say(note)


def _events(checks: Sequence[Check]) -> int:
    return sum({c.case: c.events for c in checks}.values())
