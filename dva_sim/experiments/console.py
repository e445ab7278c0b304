"""What the command line does with the parts: run, show progress, tell stories, list names."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from dva_sim import resources
from dva_sim import scenario as scenarios
from dva_sim.config import parse_changes
from dva_sim.errors import ConfigError
from dva_sim.experiments import shifts
from dva_sim.experiments import trials as tasks
from dva_sim.experiments.models import model_of
from dva_sim.experiments.pictures import Wanted
from dva_sim.experiments.transports import TransportScenario, told
from dva_sim.scenario import Scenario
from dva_sim.simulation import Recording, simulate
from dva_sim.tasks import TaskScenario
from dva_sim.timed import TimedScenario

INTERRUPTED = 130  # exit code of a program ended by Ctrl-C
PATTERNS = ("req-rep", "pipelined", "pub-sub", "latest-wins")
STYLES = {"safety": "bold red", "mode": "dim", "order": "cyan", "drive": "cyan", "link": "yellow"}

console = Console(highlight=False)
say = partial(console.print, soft_wrap=True)  # one line stays one line, also in a file


# --- episodes --------------------------------------------------------------------------


def episode(
    name: str, seed: int, pairs: list[str], side_by_side: str | None, pictures: Wanted
) -> None:
    """Run one scenario, tell its timeline, and draw the pictures asked for."""
    document = scenarios.load(name)
    changes = parse_changes(pairs)
    scenario = model_of(document).build(document, changes)
    if isinstance(scenario, TimedScenario | TransportScenario):
        if pictures.any or side_by_side is not None:
            raise ConfigError(f"{name} is a {scenario.model} scenario: there is nothing to see")
        if isinstance(scenario, TransportScenario):
            told.tell(scenario, seed, console)
        else:
            shifts.tell(scenario, seed, console)
        return
    if isinstance(scenario, TaskScenario):
        _task(name, scenario, seed, side_by_side, pictures)
        return
    settings: list[dict[str, Any]] = [changes]
    if side_by_side is not None:
        settings = [changes | {"pattern": p} for p in _two_patterns(side_by_side)]
    pictures.check(scenario)
    runs = [_tell(scenarios.build(document, each), seed, pictures.any) for each in settings]
    if pictures.any:
        with console.status("Drawing ..."):
            written = list(pictures.write(runs))
        for line in written:
            say(line)


def _task(
    name: str, scenario: TaskScenario, seed: int, side_by_side: str | None, pictures: Wanted
) -> None:
    """Play a block of trials, and draw the first one if asked for."""
    if side_by_side is not None or (pictures.any and not pictures.is_plain_still):
        raise ConfigError(f"{name} is a task: only --still shows something of it, its first trial")
    tasks.tell(scenario, seed, console)
    if pictures.still is not None:
        tasks.draw(scenario, seed, pictures.still)
        say(f"Still: {pictures.still}")


def _two_patterns(text: str) -> list[str]:
    patterns = [p.strip() for p in text.split(",")]
    wrong = [p for p in patterns if p not in PATTERNS]
    if len(patterns) != 2 or wrong:
        raise ConfigError(
            f"--side-by-side {text!r} should name two of {', '.join(PATTERNS)}, as in "
            "req-rep,latest-wins"
        )
    return patterns


def _tell(scenario: Scenario, seed: int, keep_traffic: bool) -> Recording:
    started = time.perf_counter()
    recording = simulate(scenario, seed, keep_traffic)
    took = time.perf_counter() - started
    delay = scenario.link.delay_s * 1000
    console.rule(
        f"{scenario.pattern}, {delay:g} ms each way, phone {scenario.phone.profile}, seed {seed}"
    )
    table = Table(box=None, pad_edge=False)
    for heading in ("time", "who", "what"):
        table.add_column(heading, justify="right" if heading == "time" else "left", style="")
    for moment in recording.recorder.timeline:
        style = STYLES.get(moment.kind, "")
        table.add_row(f"{moment.time:7.1f} s", moment.who, escape(moment.what), style=style)
    console.print(table)
    _summarise(recording, took)
    return recording


def _summarise(recording: Recording, took: float) -> None:
    from dva_sim.experiments.metrics import (
        drive_measures,
        event_rows,
        plugin_failures,
        run_row,
    )

    say()
    for row in event_rows(recording):
        response = f", on scene {row['response_s']:.1f} s after detection"
        known = row["response_s"] == row["response_s"]
        by = " by" if row["outcome"] in ("confirmed", "refuted") else ", looked at by"
        who = f"{by} {row['responder']}" if row["responder"] else ""
        say(f"{row['kind']}: {row['outcome']}{who}{response if known else ''}")
    row = drive_measures(recording)
    if "commands_sent" in row:
        cause = f" ({row['cause']})" if row["cause"] not in ("", row["outcome"]) else ""
        say(f"robots: {row['outcome']}{cause} in {row['attempts']} attempt(s), {_driven(row)}")
    if recording.people:
        say(f"people: {_fared(run_row(recording), recording)}")
    broken = sum(recording.recorder.violations.values())
    say(
        f"{recording.duration:.0f} s simulated in {took:.2f} s, "
        f"{recording.recorder.counters['messages']} messages, {broken} safety rules broken"
    )
    if failures := plugin_failures(recording):
        say(f"{failures} times an operator, filter, mapping or drive of yours gave no answer")


def _driven(row: dict[str, Any]) -> str:
    parts = [f"{row['contacts']} contacts"]
    if row["jams"]:
        parts.append(f"{row['jams']} jams")
    if row["commands_sent"]:
        commands = f"{row['commands_applied']} of {row['commands_sent']} commands applied"
        age = f"median age {row['command_age_p50_s']:.2f} s"
        parts = [commands, age, f"{row['command_rate_hz']:.1f} per s", *parts]
    return ", ".join(parts)


def _fared(row: dict[str, Any], recording: Recording) -> str:
    parts = [f"{row['person_exposure_s']:.0f} s in danger"]
    doses = f"{row['dose_heat_max']:.2g} of heat, {row['dose_toxic_max']:.2g} of carbon monoxide"
    parts.append(f"largest dose {doses}")
    if row["incapacitated"]:
        parts.append(f"{row['incapacitated']} incapacitated")
    out = [p.out for p in recording.people if p.out < recording.duration]
    if "evacuated_share" in row:
        count = sum(p.kind == "bystander" for p in recording.people)
        last = f", the last at {max(out):.0f} s" if out else ""
        parts.insert(0, f"{len(out)} of {count} bystanders out{last}")
    return ", ".join(parts)


# --- studies ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Version:
    """Which version of a study is meant.

    Attributes:
        full: The larger one.
        pilot: Only so many persons.
    """

    full: bool = False
    pilot: int | None = None

    def folder(self, name: str) -> Path:
        """Where results go if nobody says: each version has its own folder."""
        marks = ["-full"] * self.full + ["-pilot"] * (self.pilot is not None)
        return Path("results") / "".join([Path(name).stem, *marks])


def run(
    name: str,
    pairs: list[str],
    out: Path | None,
    jobs: int | None,
    limit_s: float,
    version: Version,
) -> int:
    """Run a study with a progress bar, then write its report; the exit code."""
    from dva_sim.experiments.episode import rehearse_all
    from dva_sim.experiments.report import write_report
    from dva_sim.experiments.results import Results
    from dva_sim.experiments.runner import dry_run, run_study
    from dva_sim.experiments.study import load_study

    study = load_study(name, pairs, full=version.full, pilot=version.pilot)
    folder = out if out is not None else version.folder(name)
    say(f"[bold]{escape(study.question)}[/bold]")
    before = dry_run(study, folder, jobs=jobs)
    rehearse_all(study)
    _say_plan(before, folder)
    try:
        with _bar() as bar:
            task = bar.add_task("running", total=before.runs)
            show = partial(_show, bar, task)
            run_study(study, folder, jobs=jobs, progress=show, limit_s=limit_s)
    except KeyboardInterrupt as stopped:
        say(f"Stopped. {stopped}")
        return INTERRUPTED
    failures = Results.load(folder).failures
    with console.status("Writing the report ..."):
        report = write_report(folder)
    for f in failures[:5]:
        where = f"{f['part']}, cell {f['cell']}, person {f['person']}, trial {f['trial']}"
        say(f"[red]failed:[/red] {where}: {escape(str(f['error']).splitlines()[-1])}")
    if failures:
        say(f"[red]{len(failures)} runs failed[/red]; the same command tries them again")
    say(f"Report: {report}")
    return 1 if failures else 0


def tune(name: str, out: Path | None, jobs: int | None) -> int:
    """Choose what a study has tuned, and write it beside the study; the exit code."""
    from dva_sim.experiments.runner import dry_run
    from dva_sim.experiments.study import load_study
    from dva_sim.experiments.tuned import save_tuned
    from dva_sim.experiments.tuning import tune as try_all
    from dva_sim.experiments.tuning import tuning_study

    study = load_study(name)
    trials = tuning_study(study)
    folder = out if out is not None else Path("results") / f"{Path(name).stem}-tuning"
    say(f"[bold]{escape(trials.question)}[/bold]")
    before = dry_run(trials, folder, jobs=jobs)
    _say_plan(before, folder)
    try:
        with _bar() as bar:
            task = bar.add_task("trying", total=before.runs)
            show = partial(_show, bar, task)
            tuned = try_all(study, folder, jobs=jobs, progress=show)
    except KeyboardInterrupt as stopped:
        say(f"Stopped. {stopped}")
        return INTERRUPTED
    for choice in tuned.chosen:
        when = ", ".join(f"{name} {level}" for name, level in choice.when.items())
        say(f"{when}: {tuned.tuning.key} {choice.value:g}")
    say(f"Kept in {save_tuned(study, tuned)}")
    return 0


def plan(name: str, pairs: list[str], out: Path | None, jobs: int | None, version: Version) -> None:
    """Say what `run` would do."""
    from dva_sim.experiments.episode import rehearse_all
    from dva_sim.experiments.runner import dry_run
    from dva_sim.experiments.study import load_study

    study = load_study(name, pairs, full=version.full, pilot=version.pilot)
    folder = out if out is not None else version.folder(name)
    plan = dry_run(study, folder, jobs=jobs)
    rehearse_all(study)
    _say_plan(plan, folder)


def _say_plan(plan: Any, folder: Path) -> None:
    if plan.remark:
        say(f"[yellow]{escape(plan.remark)}[/yellow]")
    done = f", {plan.done} of them done already" if plan.done else ""
    about = "" if plan.estimate_s is None else f", about {plan.estimate_s:.0f} s to go"
    say(f"{plan.runs} runs in {plan.cells} configurations{done}{about}; into {folder}")


def _bar() -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        _Rate(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
    )


def _show(bar: Progress, task: TaskID, done: int, total: int) -> None:
    bar.update(task, completed=done, total=total)


class _Rate(ProgressColumn):
    """Runs per second."""

    def render(self, task: Task) -> str:
        speed = task.finished_speed or task.speed
        return "" if speed is None else f"{speed:.1f} runs/s"


# --- names -----------------------------------------------------------------------------


def list_all() -> None:
    """Everything that can be named in a configuration."""
    from dva_sim.agents.operator.strategies import known_strategies
    from dva_sim.agents.tilt import known_filters, known_mappings
    from dva_sim.core.dispatch import known_policies

    from_files = {
        "studies": "experiments",
        "scenarios": "experiments/scenarios",
        "tasks (tasks/NAME)": "experiments/scenarios/tasks",
        "sites": "worlds",
        "phones (phone.profile)": "agents/phones",
        "accelerometers": "agents/accelerometers",
        "robots": "agents/robots",
        "people": "agents/people",
    }
    table = Table(box=None, pad_edge=False, show_header=False)
    for title, folder in from_files.items():
        table.add_row(title, ", ".join(sorted(resources.available(folder))))
    table.add_row("patterns", ", ".join(PATTERNS))
    table.add_row("operators", ", ".join(known_strategies()))
    table.add_row("filters", ", ".join(known_filters()))
    table.add_row("mappings", ", ".join(known_mappings()))
    table.add_row("policies", ", ".join(known_policies()))
    console.print(table)
