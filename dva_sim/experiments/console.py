"""What the command line does with single runs, and the list of all names; studies stand apart."""

from __future__ import annotations

import io
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape

from dva_sim import scenario as scenarios
from dva_sim.changing import parse_changes
from dva_sim.errors import ConfigError
from dva_sim.experiments import shifts, telling
from dva_sim.experiments import trials as tasks
from dva_sim.experiments.models import Tables, model_of, tables_of
from dva_sim.experiments.pictures import Wanted
from dva_sim.experiments.transports import TransportScenario, told
from dva_sim.recordings import write_recording
from dva_sim.scenario import Scenario, contradictions
from dva_sim.simulation import Playback, Recording, simulate
from dva_sim.tasks import TaskScenario
from dva_sim.timed import TimedScenario

PATTERNS = ("req-rep", "pipelined", "pub-sub", "latest-wins")

console = Console(highlight=False)
say = partial(console.print, soft_wrap=True)  # one line stays one line, also in a file


def nowhere() -> Console:
    """For what need not be told."""
    return Console(file=io.StringIO(), quiet=True)


# --- episodes --------------------------------------------------------------------------


def warn(doubts: Sequence[str], where: Console = console) -> None:
    """Say what does not go together, a line for each."""
    for doubt in doubts:
        where.print(f"[yellow]warning:[/yellow] {escape(doubt)}", soft_wrap=True)


def episode(
    name: str,
    seed: int,
    pairs: list[str],
    side_by_side: str | None,
    pictures: Wanted,
    record: Path | None,
    where: Console = console,
) -> Recording | None:
    """Run one scenario, tell its timeline, draw the pictures asked for, and keep it if asked to.

    Returns:
        The run, if it is of the full model; of two side by side the first.
    """
    if record is not None:
        _check_record(record, side_by_side)
    if side_by_side is not None and pictures.camera is not None:
        raise ConfigError("--camera shows one run; it does not go with --side-by-side")
    document = scenarios.load(name)
    changes = parse_changes(pairs)
    scenario = model_of(document).build(document, changes)
    if record is not None and not isinstance(scenario, Scenario):
        raise ConfigError(f"{name} is a {scenario.model} scenario: only full ones are recorded")
    if isinstance(scenario, TimedScenario | TransportScenario):
        if side_by_side is not None:
            raise ConfigError(f"{name} is a {scenario.model} scenario: only full ones run twice")
        if pictures.any:
            raise ConfigError(f"{name} is a {scenario.model} scenario: there is nothing to see")
        if isinstance(scenario, TransportScenario):
            told.tell(scenario, seed, where)
        else:
            shifts.tell(scenario, seed, where)
        return None
    if isinstance(scenario, TaskScenario):
        _task(name, scenario, seed, side_by_side, pictures, where)
        return None
    settings: list[dict[str, Any]] = [changes]
    if side_by_side is not None:
        settings = [changes | {"pattern": p} for p in _two_patterns(side_by_side)]
    pictures.check(scenario)
    keep = pictures.any or record is not None
    built = [scenarios.build(document, each) for each in settings]
    warn(list(dict.fromkeys(told for each in built for told in contradictions(each))), where)
    played = [_tell(each, seed, keep, where) for each in built]
    runs = [run for run, _ in played]
    if side_by_side is not None:
        telling.tell_side_by_side(runs, where)
    if record is not None:
        write_recording(runs[0], record, tables=played[0][1], about={"scenario": name})
        where.print(f"Recording: {record}", soft_wrap=True)
    draw(pictures, runs, where)
    return runs[0]


def draw(pictures: Wanted, runs: Sequence[Playback], where: Console) -> None:
    """Write the pictures asked for, and say where they are."""
    if not pictures.any:
        return
    with where.status("Drawing ..."):
        written = list(pictures.write(runs))
    for line in written:
        where.print(line, soft_wrap=True)


def _check_record(path: Path, side_by_side: str | None) -> None:
    """What cannot be kept is told before anything is run."""
    if side_by_side is not None:
        raise ConfigError("--record keeps one run; it does not go with --side-by-side")
    if path.suffix.lower() != ".mcap":
        raise ConfigError(f"recording should end in .mcap, not {path.name!r}")
    if not path.parent.is_dir():
        raise ConfigError(f"folder {str(path.parent)!r} for the recording does not exist")


def _task(
    name: str,
    scenario: TaskScenario,
    seed: int,
    side_by_side: str | None,
    pictures: Wanted,
    where: Console,
) -> None:
    """Play a block of trials, and draw the first one if asked for."""
    if side_by_side is not None or (pictures.any and not pictures.is_plain_still):
        raise ConfigError(f"{name} is a task: only --still shows something of it, its first trial")
    tasks.tell(scenario, seed, where)
    if pictures.still is not None:
        tasks.draw(scenario, seed, pictures.still)
        where.print(f"Still: {pictures.still}", soft_wrap=True)


def _two_patterns(text: str) -> list[str]:
    patterns = [p.strip() for p in text.split(",")]
    wrong = [p for p in patterns if p not in PATTERNS]
    if len(patterns) != 2 or wrong:
        raise ConfigError(
            f"--side-by-side {text!r} should name two of {', '.join(PATTERNS)}, as in "
            "req-rep,latest-wins"
        )
    return patterns


def _tell(
    scenario: Scenario, seed: int, keep_traffic: bool, where: Console
) -> tuple[Recording, Tables]:
    started = time.perf_counter()
    recording = simulate(scenario, seed, keep_traffic)
    took, tables = time.perf_counter() - started, tables_of(recording)
    telling.tell_story(recording, where)
    telling.tell_outcome(tables, f"simulated in {took:.2f} s", where)
    return recording, tables
