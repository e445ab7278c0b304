"""`dva-sim validate`: plays or measures, shows progress on a terminal, ends with a verdict."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from rich import progress as bars
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from dva_sim.agents.operator.published import load_split, load_targets, target_lines
from dva_sim.agents.operator.strategies import try_strategy
from dva_sim.cli.console import console, say
from dva_sim.cli.verbosity import detail
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.errors import ConfigError, ExitCode
from dva_sim.kernel.suggestions import either
from dva_sim.options.studies import VALIDATED, ValidateOptions
from dva_sim.validation.dispatch import cases, identities
from dva_sim.validation.dispatch import checks as dispatch
from dva_sim.validation.evidence_page import ResultSheet, ValidationResult
from dva_sim.validation.network import comparison, reference
from dva_sim.validation.network import evidence as network_evidence
from dva_sim.validation.network.beside import measured as beside
from dva_sim.validation.network.beside import predictions
from dva_sim.validation.network.real_side import measuring
from dva_sim.validation.network.real_side.cell import PACKETS, PROXY, why_no_packets
from dva_sim.validation.network.real_side.measuring import Progress
from dva_sim.validation.network.verdicts import ConditionGroup, grouped
from dva_sim.validation.operators import evidence as operators_evidence
from dva_sim.validation.operators import experiments as operators
from dva_sim.validation.operators.exact import MODEL_CHECKS
from dva_sim.validation.operators.experiments import EXPERIMENTS

WIDTH = 110  # minimum width of tables, also in a file
_COMMANDS = ".csv.gz"  # ending of a table of commands
_WIDTHS = {"line": 5, "claim": 6, "predicted": 4, "verdict": 6}  # shares of the width
_STYLES = {"holds": "green", "misses": "bold red", "too rough": "yellow", "shown only": "dim"}


def validate(options: ValidateOptions) -> ExitCode:
    """Play, print the comparison, write it if asked to; how it ended.

    Raises:
        ConfigError: something else to validate, an option that belongs to another, or a
            mistake in the files.
        EmulatorError: nothing can be measured here.
    """
    what = options.what
    out = options.out
    quick = options.quick
    seed = options.seed
    _refuse_foreign(options)
    if out is not None and out.exists() and not out.is_dir():
        raise ConfigError(f"--out {out} is a file; give a folder")
    workers = options.jobs or os.cpu_count() or 1
    detail(f"{what}, seed {seed}, {workers} processes{', quick' if quick else ''}")
    for key in ("cases", "strategy", "out"):
        value = getattr(options, key)
        detail(f"  {key}: {'as shipped' if value is None else value}")
    if what == "dispatch":
        return conclude(partial(_dispatch, options.cases, quick, workers, seed), out)
    if what == "operators":
        return conclude(partial(_operators, options.strategy, quick, workers, seed), out)
    if options.beside is not None:
        return conclude(partial(_beside, options.beside, quick, workers), out)
    setting = comparison.NetworkSetting(seed, quick, workers, options.ablate)
    return _network(options.cases, setting, options.measure, options.live, out)


def _refuse_foreign(options: ValidateOptions) -> None:
    """Refuse something else to validate, and options that belong to another."""
    what = options.what
    if what not in VALIDATED:
        raise ConfigError(f"{what!r} cannot be validated; should be {either(VALIDATED)}")
    if options.strategy is not None and what != "operators":
        raise ConfigError(f"--strategy is for `validate operators`: {what} has none")
    if options.cases is not None and what == "operators":
        text = "`validate dispatch` and `validate network`: operators have no cases"
        raise ConfigError(f"--cases is for {text}")
    measures = options.measure is not None or options.beside is not None
    if (options.ablate or options.live or measures) and what != "network":
        text = "--ablate, --live, --measure and --beside are for `validate network`"
        raise ConfigError(text)


def conclude(play: Callable[[], ValidationResult], out: Path | None) -> ExitCode:
    """Play, show the verdict and the evidence, write them to `out` if given; the exit code."""
    started = time.perf_counter()
    result = play()
    say(f"[bold]{escape(result.headline)}[/bold]")
    for note in result.notes:
        say(escape(note))
    for sheet in result.printed:
        _tell(sheet)
    say(f"\n{time.perf_counter() - started:.0f} s")
    if out is not None:
        say(f"Report: {result.write(out)}")
    return ExitCode.OK if result.passes else ExitCode.GATE_FAILED


def _tell(sheet: ResultSheet) -> None:
    """Show a title, and lines whose verdict at the end is coloured.

    A narrow terminal breaks its lines: better than numbers that are cut off.
    """
    where = Console(highlight=False, width=max(console.width, WIDTH))
    where.print(f"\n[bold]{escape(sheet.title)}[/bold]")
    if sheet.text:
        where.print(escape(sheet.text))
    table = _table(sheet.heads, with_heads=True)
    for row in sheet.rows:
        if len(row) > 1:
            verdict = row[-1]
            style = _STYLES.get(verdict.partition(":")[0])
            coloured = f"[{style}]{escape(verdict)}[/]" if style else escape(verdict)
            table.add_row(*map(escape, row[:-1]), coloured)
            continue
        if table.row_count:
            where.print(table)
            table = _table(sheet.heads, with_heads=False)
        where.print(f"[dim]{escape(row[0])}[/dim]")
    if table.row_count:
        where.print(table)


def _table(heads: Sequence[str], with_heads: bool) -> Table:
    """Return a table of even columns, so that those below each other agree."""
    table = Table(box=None, pad_edge=False, expand=True, show_header=with_heads)
    for head in heads:
        table.add_column(escape(head), ratio=_WIDTHS.get(head, 3), overflow="fold")
    return table


def _bar() -> bars.Progress:
    """Return a progress bar with the current task, the finished share, and the elapsed time."""
    words = bars.TextColumn("{task.description}")
    done = bars.MofNCompleteColumn()
    return bars.Progress(words, bars.BarColumn(), done, bars.TimeElapsedColumn(), console=console)


# --- dispatch --------------------------------------------------------------------------
def _dispatch(case_file: str | None, quick: bool, workers: int, seed: int) -> ValidationResult:
    name = case_file or cases.SHIPPED
    played = cases.load_cases(name)
    with _bar() as bar:
        first = len(identities.IDENTITIES)
        task = bar.add_task("identities", total=first + dispatch.runs_of(played, quick))
        checks = dispatch.check_identities(seed, lambda n: bar.update(task, completed=n))
        bar.update(task, description="cases")
        checks += dispatch.check_cases(
            played, seed, quick, workers, lambda n: bar.update(task, completed=first + n)
        )
    conditions = {"cases": f"{name} ({len(played)})", "seed": str(seed), "length": _length(quick)}
    return dispatch.evidence(checks, conditions, quick)


def _length(quick: bool) -> str:
    return "quick" if quick else "full"


# --- operators -------------------------------------------------------------------------
def _operators(strategy: str | None, quick: bool, workers: int, seed: int) -> ValidationResult:
    split = load_split()
    lines = target_lines(load_targets(), split)
    persons = operators.QUICK_PERSONS if quick else operators.PERSONS
    setting = operators.OperatorsSetting(strategy or split.strategy, seed, persons, quick, workers)
    try_strategy(setting.strategy)  # whether there is one, is known before anything is played
    with _bar() as bar:
        exact = len(MODEL_CHECKS)
        task = bar.add_task("exact", total=exact + operators.count_jobs(EXPERIMENTS, setting))
        simulated = operators.play_exact(
            list(MODEL_CHECKS), setting, lambda n: bar.update(task, completed=n)
        )
        bar.update(task, description="persons")
        played = operators.play_experiments(
            EXPERIMENTS, setting, lambda n: bar.update(task, completed=exact + n)
        )
    simulated |= operators.measured(EXPERIMENTS, played, seed)
    conditions = {
        "operators": setting.strategy,
        "persons": str(persons),
        "seed": str(seed),
        "length": _length(quick),
    }
    return operators_evidence.evidence(
        lines, simulated, split, played=played, conditions=conditions
    )


# --- the network -----------------------------------------------------------------------
def _network(
    case_file: str | None,
    setting: comparison.NetworkSetting,
    measure: Path | None,
    live: bool,
    out: Path | None,
) -> ExitCode:
    """Compare with measurements that there are, or with some made now; or only make them."""
    plan = reference.load_plan(case_file or reference.SHIPPED)
    if measure is not None:
        with _bar() as bar:
            failures = measuring.measure_design(plan.own.blocks, measure, _teller(bar))
        _complain([*failures, f"{measure} holds what could be measured."])
        return ExitCode.RUNS_FAILED if failures else ExitCode.OK
    if not live:
        made = {n: _joined(source.made_with) for n, source in plan.sources.items()}
        return judge_runs(reference.load_runs(plan.sources), made, out, setting, plan.causes)
    with TemporaryDirectory() as folder:
        path = (out or Path(folder)) / "measured.csv"
        runs = _measured_now(plan.own.blocks, path, setting.quick)
        made = {"measured on": measuring.made_with(path)}
        return judge_runs(runs, made, out, setting, plan.causes)


def judge_runs(
    runs: Sequence[reference.SocketRun],
    conditions: dict[str, str],
    out: Path | None,
    setting: comparison.NetworkSetting,
    causes: Mapping[str, str],
) -> ExitCode:
    """Compare the model with measurements, print it, write it if asked to; how it ended."""
    return conclude(partial(_compared, grouped(runs), conditions, setting, causes), out)


def _compared(
    groups: Sequence[ConditionGroup],
    conditions: dict[str, str],
    setting: comparison.NetworkSetting,
    causes: Mapping[str, str],
) -> ValidationResult:
    with _bar() as bar:
        task = bar.add_task("runs of the model", total=comparison.runs_in(groups, setting))
        comparisons = comparison.compare(groups, setting, lambda n: bar.update(task, completed=n))
    depths = ", ".join(
        f"{depth} {count}" for depth, count in comparison.count_depths(comparisons).items()
    )
    conditions = conditions | {
        "depth of the model, conditions": depths,
        "seed": str(setting.seed),
        "length": _length(setting.quick),
    }
    return network_evidence.evidence(comparisons, conditions, causes)


def _beside(source: str, quick: bool, workers: int) -> ValidationResult:
    """Return predictions of a middleware study, with its results beside them if there are any."""
    results = Results.load(source) if Path(source).is_dir() else None
    has_commands = source.endswith(_COMMANDS)
    study = (
        load_study(beside.STUDY if has_commands else source)
        if results is None
        else Study.model_validate(results.study)
    )
    configurations = beside.asked_by(study, results)
    measured = None if results is None else beside.measured_in(results)
    if has_commands:
        measured = beside.measured_in_commands(Path(source), configurations)
    plays = predictions.QUICK_PLAYS if quick else predictions.PLAYS
    with _bar() as bar:
        task = bar.add_task("runs of the model")
        result = beside.beside_of(
            configurations,
            measured,
            plays,
            workers,
            lambda done, of: bar.update(task, completed=done, total=of),
        )
    return replace(result, conditions={"study": source, "plays of each seed": str(plays)})


def _measured_now(
    blocks: Sequence[reference.BlockConfig], path: Path, quick: bool
) -> list[reference.SocketRun]:
    """Measure now; where packets cannot be emulated, over a TCP relay on the loopback."""
    why = why_no_packets()
    if why:
        relay = "A relay over the loopback takes its place"
        _complain([why, f"{relay}; it can neither lose nor reorder packets."])
    with _bar() as bar:
        link = PROXY if why else PACKETS
        runs, problems = measuring.measure_now(blocks, path, quick, link, _teller(bar))
    _complain(problems)
    return runs


def _teller(bar: bars.Progress) -> measuring.Tell:
    """Return moves a bar of its own for each block."""
    tasks: dict[str, bars.TaskID] = {}

    def tell(block: str, progress: Progress) -> None:
        if block not in tasks:
            tasks[block] = bar.add_task(block)
        left = f"{block}, {progress.left_s / 60:.0f} min left"
        bar.update(tasks[block], completed=progress.done, total=progress.total, description=left)

    return tell


def _complain(lines: Sequence[str]) -> None:
    for line in lines:
        say(line, markup=False)


def _joined(made_with: Mapping[str, str]) -> str:
    return "; ".join(f"{name} {value}" for name, value in made_with.items())
