"""A run told in the terminal: its story line by line, then what came of it.

What the command line does with single runs, and the list of all names; studies stand apart.

`dva-sim replay`: a recording told and drawn from its file alone, or taken to ROS 2.
"""

from __future__ import annotations

import io
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from dva_sim.cli import shift_output
from dva_sim.cli import task_output as tasks
from dva_sim.cli.verbose_details import tell_measures
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.key_changes import parse_changes
from dva_sim.recordings import Opened, read_recording, write_recording
from dva_sim.recordings.pictures import Wanted
from dva_sim.recordings.pictures.moments import story
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import Playback, Recording, simulate
from dva_sim.simulation.models import Tables, model_of, tables_of
from dva_sim.simulation.scenario import Scenario, contradictions
from dva_sim.simulation.shift import TimedScenario
from dva_sim.simulation.task import TaskScenario
from dva_sim.simulation.transport import TransportScenario

STYLES = {"safety": "bold red", "mode": "dim", "order": "cyan", "drive": "cyan", "link": "yellow"}
DRIVES = {"lost link": "given up, the link was taken for lost", "gave up": "given up"}

Row = Mapping[str, Any]


def tell_story(playback: Playback, console: Console) -> None:
    """What happened, in order."""
    scenario = playback.scenario
    delay, phone = scenario.link.delay_s * 1000, scenario.phone.profile
    console.rule(f"{scenario.pattern}, {delay:g} ms each way, phone {phone}, seed {playback.seed}")
    table = Table(box=None, pad_edge=False)
    for heading in ("time", "who", "what"):
        table.add_column(heading, justify="right" if heading == "time" else "left", style="")
    for moment in playback.recorder.timeline:
        style = STYLES.get(moment.kind, "")
        table.add_row(f"{moment.time:7.1f} s", moment.who, escape(moment.what), style=style)
    console.print(table)


def tell_side_by_side(runs: Sequence[Playback], console: Console) -> None:
    """How runs under several patterns ended, beside each other."""
    console.rule("side by side")
    for line in story(runs):
        console.print(line, soft_wrap=True)


def tell_outcome(tables: Tables, how: str, console: Console) -> None:
    """What came of it.

    Args:
        tables: The rows of the run, by table.
        how: How it came about, after its length in seconds.
        console: Where.
    """
    row = tables["runs"][0]
    lines = [_event(event) for event in tables["events"]]
    if "commands_sent" in row:
        cause = f" ({row['cause']})" if row["cause"] not in ("", row["outcome"]) else ""
        attempts = f"in {row['attempts']} attempt{'s' * (row['attempts'] != 1)}"
        outcome = DRIVES.get(row["outcome"], row["outcome"])
        lines.append(f"robots: {outcome}{cause} {attempts}, {_driven(row)}")
    if tables["people"]:
        lines.append(f"people: {_fared(row, tables['people'])}")
    counts = f"{row['messages']} messages, {row['violations']} safety rules broken"
    lines.append(f"{row['simulated_s']:.0f} s {how}, {counts}")
    if failures := row["plugin_failures"]:
        lines.append(
            f"{failures} times an operator, filter, mapping or drive of yours gave no answer"
        )
    for line in ("", *lines):
        console.print(line, soft_wrap=True)
    tell_measures(row, "full")


def _event(row: Row) -> str:
    known = row["response_s"] == row["response_s"]
    response = f", on scene {row['response_s']:.1f} s after detection" if known else ""
    by = " by" if row["outcome"] in ("confirmed", "refuted") else ", looked at by"
    who = f"{by} {row['responder']}" if row["responder"] else ""
    return f"{row['kind']}: {row['outcome']}{who}{response}"


def _driven(row: Row) -> str:
    parts = [f"{row['contacts']} contacts"]
    if row["jams"]:
        parts.append(f"{row['jams']} jams")
    if row["commands_sent"]:
        commands = f"{row['commands_applied']} of {row['commands_sent']} commands applied"
        age = f"median age {row['command_age_p50_s']:.2f} s"
        parts = [commands, age, f"{row['command_rate_hz']:.1f} per s", *parts]
    return ", ".join(parts)


def _fared(row: Row, people: list[dict[str, Any]]) -> str:
    parts = [f"{row['person_exposure_s']:.0f} s in danger"]
    doses = f"{row['dose_heat_max']:.2g} of heat, {row['dose_toxic_max']:.2g} of carbon monoxide"
    parts.append(f"largest dose {doses}")
    if row["incapacitated"]:
        parts.append(f"{row['incapacitated']} incapacitated")
    if "evacuated_share" in row:
        out = [p["t_out_s"] for p in people if p["t_out_s"] == p["t_out_s"]]
        count = sum(p["kind"] == "bystander" for p in people)
        last = f", the last at {max(out):.0f} s" if out else ""
        parts.insert(0, f"{len(out)} of {count} bystanders out{last}")
    return ", ".join(parts)


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
            shift_output.tell_session(scenario, seed, where)
        else:
            shift_output.tell_shift(scenario, seed, where)
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
    warn(
        list(
            dict.fromkeys(shift_output for each in built for shift_output in contradictions(each))
        ),
        where,
    )
    played = [_tell(each, seed, keep, where) for each in built]
    runs = [run for run, _ in played]
    if side_by_side is not None:
        tell_side_by_side(runs, where)
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
    tell_story(recording, where)
    tell_outcome(tables, f"simulated in {took:.2f} s", where)
    return recording, tables


def replay(file: Path, pictures: Wanted, ros2: Path | None, where: Console = console) -> Opened:
    """Tell the story of a recording, and draw or export what is asked for.

    Raises:
        ConfigError: not a recording, or what is asked for is not in it.
    """
    opened = read_recording(file)
    run = opened.playback
    pictures.check(run.scenario)
    tell_story(run, where)
    if opened.tables is not None:
        made = f"simulated by dva-sim {opened.about['version']}"
        tell_outcome(opened.tables, made, where)
    if not opened.is_whole:
        there = f"{run.duration:.0f} of {opened.lasted:.0f} s are there"
        where.print(f"[yellow]{file} was cut short: {there}[/yellow]", soft_wrap=True)
    draw(pictures, [run], where)
    if ros2 is not None:
        from dva_sim.recordings.ros2 import write_bag

        write_bag(run, ros2)
        where.print(f"ROS 2 bag: {ros2}", soft_wrap=True)
    return opened
