"""What the command line does with a validation of operators: play, tell, write."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from dva_sim.agents.operator.published import lines_of, load_split, load_targets
from dva_sim.agents.operator.strategies import try_strategy
from dva_sim.kernel.errors import ExitCode
from dva_sim.validation.frame import WIDTH, console, progress_bar, say
from dva_sim.validation.operators import result_page
from dva_sim.validation.operators.exact import EXACT
from dva_sim.validation.operators.experiments import EXPERIMENTS
from dva_sim.validation.operators.judging import Cells, Found, Verdict, judge, outcome_of
from dva_sim.validation.operators.play import (
    PERSONS,
    QUICK_PERSONS,
    Setting,
    jobs_of,
    measured,
    play_exact,
    play_experiments,
)

COLUMNS = (17, None, None, None, 19)  # characters; None: an equal share of the rest
STYLES = {"passes": "green", "misses": "bold red", "shown only": "dim"}


def validate_operators(
    strategy: str | None, out: Path | None, quick: bool, jobs: int, seed: int
) -> ExitCode:
    """Play every check, print the comparison, write it if asked to; how it ended.

    Raises:
        ConfigError: there is no such strategy, or a mistake in the files.
    """
    started = time.perf_counter()
    split = load_split()
    lines = lines_of(load_targets(), split)
    persons = QUICK_PERSONS if quick else PERSONS
    setting = Setting(strategy or split.strategy, seed, persons, quick, jobs)
    try_strategy(setting.strategy)  # whether there is one, is known before anything is played
    found, played = _play(setting)
    verdicts = judge(lines, found)
    outcome = outcome_of(verdicts, split.rule)
    _tell(verdicts, played)
    say(f"[bold]{result_page.headline(outcome)}[/bold]")
    for note in result_page.notes(verdicts):
        say(escape(note))
    say(f"{time.perf_counter() - started:.0f} s")
    if out is not None:
        page = result_page.write(out, verdicts, outcome, played, _conditions(setting))
        say(f"Report: {page}")
    return ExitCode.OK if outcome.passes else ExitCode.GATE_FAILED


def _play(setting: Setting) -> tuple[dict[str, Found], dict[str, Cells]]:
    with progress_bar() as bar:
        exact = len(EXACT)
        task = bar.add_task("exact", total=exact + jobs_of(EXPERIMENTS, setting))
        found = play_exact(list(EXACT), setting, lambda n: bar.update(task, completed=n))
        bar.update(task, description="persons")
        played = play_experiments(
            EXPERIMENTS, setting, lambda n: bar.update(task, completed=exact + n)
        )
    return found | measured(EXPERIMENTS, played, setting.seed), played


def _conditions(setting: Setting) -> dict[str, str]:
    return {
        "operators": setting.strategy,
        "persons": str(setting.persons),
        "seed": str(setting.seed),
        "length": "quick" if setting.quick else "full",
    }


def _tell(verdicts: Sequence[Verdict], played: Mapping[str, Cells]) -> None:
    """The lines under their headings, and how they steered."""
    wide = Console(highlight=False, width=max(console.width, WIDTH))
    for title, own in result_page.grouped(verdicts):
        wide.print(f"\n[bold]{title}[/bold]")
        wide.print(_table(own))
    wide.print("\n[bold]How they steered[/bold]")
    heads = "experiment", "share of the time in which they moved and waited"
    shares = Table(*heads, box=None, pad_edge=False)
    for row in result_page.steered(played):
        shares.add_row(*map(escape, row))
    wide.print(shares)


def _table(verdicts: Sequence[Verdict]) -> Table:
    """Lines whose columns stand below each other from table to table."""
    table = Table(box=None, pad_edge=False, expand=True)
    for head, width in zip(result_page.HEADS, COLUMNS, strict=True):
        table.add_column(head, width=width, ratio=None if width else 1)
    for verdict in verdicts:
        *cells, said = result_page.words(verdict)
        table.add_row(*map(escape, cells), f"[{STYLES[verdict.word]}]{said}[/]")
    return table
