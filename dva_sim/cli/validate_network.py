"""What the command line does with a validation of the network: play or measure, tell, write."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from dva_sim.kernel.errors import ExitCode
from dva_sim.validation.frame import console, progress_bar, say
from dva_sim.validation.network import result_page
from dva_sim.validation.network.comparison import Comparison, Setting, compare, depths_of, runs_in
from dva_sim.validation.network.judging import KINDS, Group, grouped
from dva_sim.validation.network.measuring import made_with, measure_design, measure_now
from dva_sim.validation.network.reference import SHIPPED, Run, SourceConfig, load_plan, load_runs
from dva_sim.validation.network.result_page import HEADS, table

WIDTH = 240  # of the table of conditions at least, also in a file
_STYLES = {"passes": "green", "found out": "green", "fails": "bold red", "fooled us": "bold red"}
_WORST = 12  # of the largest z that are named


def validate_network(
    plan_name: str | None, out: Path | None, setting: Setting, measure: Path | None, live: bool
) -> ExitCode:
    """Compare the model with measurements, or make some; how it ended.

    Args:
        plan_name: The document that says where measurements are, and what to measure.
        out: Where tables, figures and the page go.
        setting: How much of the model is played.
        measure: Table that takes the design's measurements; nothing is compared then.
        live: Measure some of the design now, and compare with that alone.

    Raises:
        ConfigError: a mistake in the files.
        EmulatorError: nothing can be measured here.
    """
    plan = load_plan(plan_name or SHIPPED)
    if measure is not None:
        return measure_design(plan.own.blocks, measure)
    if not live:
        conditions = {name: _told(source) for name, source in plan.sources.items()}
        return judge_runs(load_runs(plan.sources), conditions, out, setting)
    with TemporaryDirectory() as folder:
        path = (out or Path(folder)) / "measured.csv"
        runs = measure_now(plan.own.blocks, path, setting.quick)
        return judge_runs(runs, {"measured on": made_with(path)}, out, setting)


def judge_runs(
    runs: Sequence[Run], conditions: dict[str, str], out: Path | None, setting: Setting
) -> ExitCode:
    """Compare the model with measurements, print it, write it if asked to; how it ended."""
    started = time.perf_counter()
    comparison = _play(grouped(runs), setting)
    _tell(comparison)
    say(f"{time.perf_counter() - started:.0f} s")
    if out is not None:
        conditions |= _settings(comparison, setting)
        say(f"Report: {result_page.write(out, comparison, conditions)}")
    return ExitCode.OK if comparison.passes else ExitCode.GATE_FAILED


def _play(groups: Sequence[Group], setting: Setting) -> Comparison:
    with progress_bar() as bar:
        task = bar.add_task("runs of the model", total=runs_in(groups, setting))
        return compare(groups, setting, lambda n: bar.update(task, completed=n))


def _told(source: SourceConfig) -> str:
    return "; ".join(f"{name} {value}" for name, value in source.made_with.items())


def _settings(comparison: Comparison, setting: Setting) -> dict[str, str]:
    depths = ", ".join(f"{depth} {count}" for depth, count in depths_of(comparison).items())
    return {
        "depth of the model, conditions": depths,
        "seed": str(setting.seed),
        "length": "quick" if setting.quick else "full",
    }


def _tell(comparison: Comparison) -> None:
    """The conditions, the criteria, and what they come to."""
    wide = Console(highlight=False, width=max(console.width, WIDTH))
    for kind in KINDS:
        rows = table(comparison, kind)
        if rows:
            wide.print(f"\n[bold]{result_page.TITLES[kind]}[/bold] (measured → predicted)")
            wide.print(_table(HEADS, rows))
    _list("Not judged", [f"{why}: {which}" for why, which in result_page.left_out(comparison)])
    _list("Largest deviations of pooled conditions", result_page.worst(comparison, _WORST))
    wide.print("\n[bold]Criteria[/bold]")
    wide.print(_table(result_page.SUMMARY_HEADS, result_page.summary(comparison)))
    if comparison.ablated:
        wide.print("\n[bold]What is left out[/bold]")
        wide.print(_table(result_page.ABLATION_HEADS, result_page.ablation(comparison)))
    say(f"\n[bold]{result_page.headline(comparison)}[/bold]")
    for note in result_page.notes(comparison):
        say(escape(note))


def _list(title: str, lines: Sequence[str]) -> None:
    """Lines under a heading, if there are any."""
    if lines:
        say(f"\n[bold]{title}[/bold]")
    for line in lines:
        say(escape(line))


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    table = Table(box=None, pad_edge=False)
    for head in heads:
        table.add_column(escape(head), no_wrap=head != heads[-1])
    for *cells, last in rows:
        style = _STYLES.get(last.split(" ")[0] if last.startswith(("pass", "fail")) else last)
        if last.startswith("misses"):
            style = "bold red"
        shown = f"[{style}]{escape(last)}[/]" if style else escape(last)
        table.add_row(*map(escape, cells), shown)
    return table
