"""Measuring on real sockets: the whole design into a table, or some of it to look at now."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from dva_sim.kernel.errors import ConfigError, ExitCode
from dva_sim.network.condition import Condition
from dva_sim.validation.frame import progress_bar, say
from dva_sim.validation.network.emulator.campaign import Progress, measure_all
from dva_sim.validation.network.emulator.cell import PACKETS, PROXY
from dva_sim.validation.network.emulator.running import why_no_packets
from dva_sim.validation.network.reference import (
    BlockConfig,
    Run,
    SourceConfig,
    conditions_of,
    read_runs,
)

QUICK_S = 12.0  # measured of each condition; enough for twenty commands in nearly all


def measure_design(blocks: Sequence[BlockConfig], path: Path) -> ExitCode:
    """Measure what a design wants and a table does not hold yet; how it ended.

    Raises:
        ConfigError: the table cannot be written, or holds something else.
        EmulatorError: the emulated link cannot be set up here.
    """
    failures = [
        problem
        for block in blocks
        for problem in _measure(
            conditions_of(block), range(1, block.seeds + 1), path, block.group, PACKETS
        )
    ]
    for problem in failures:
        say(problem, markup=False)
    say(f"{path} holds what could be measured.", markup=False)
    return ExitCode.RUNS_FAILED if failures else ExitCode.OK


def measure_now(blocks: Sequence[BlockConfig], path: Path, quick: bool) -> list[Run]:
    """Measure each condition of a design once.

    Where packets cannot be emulated, a relay of TCP over the loopback takes the place of the
    link, for the conditions without loss.

    Args:
        blocks: The design.
        path: A new table.
        quick: One pair of programs for each link, and a short time.

    Raises:
        ConfigError: the table is there already, or cannot be written.
        EmulatorError: nothing can be measured here.
    """
    if path.exists():
        raise ConfigError("is there already; --live measures afresh: remove it first", str(path))
    link, why = PACKETS, why_no_packets()
    if why:
        say(why, markup=False)
        say("A relay over the loopback takes its place; it can neither lose nor reorder packets.")
        link = PROXY
    for block in blocks:
        conditions = shortened(block) if quick else conditions_of(block)
        some = [c for c in conditions if link == PACKETS or not (c.loss or c.reorder)]
        for problem in _measure(some, [1], path, block.group, link):
            say(problem, markup=False)
    return read_runs("live", SourceConfig(file=str(path), made_with={}))


def made_with(path: Path) -> str:
    """What a table was measured on, in words."""
    machine = json.loads(path.with_suffix(".machine.json").read_text(encoding="utf-8"))
    return "; ".join(f"{name} {value}" for name, value in machine.items())


def shortened(block: BlockConfig) -> list[Condition]:
    """Each link once, with programs by turns, measured for a short time."""
    names = list(block.programs)
    found = []
    for turn, link in enumerate(block.links):
        programs = names[turn % len(names)]
        changes = {
            "links": {link: block.links[link]},
            "programs": {programs: block.programs[programs]},
            "settings": {**block.settings, "dur_s": QUICK_S},
        }
        found += conditions_of(block.model_copy(update=changes))
    return found


def _measure(
    conditions: Sequence[Condition], seeds: Sequence[int], path: Path, group: str, link: str
) -> list[str]:
    """Measure what is missing, with a bar; what failed, a line each."""
    with progress_bar() as bar:
        task = bar.add_task(group, total=len(conditions) * len(seeds))

        def tell(progress: Progress) -> None:
            left = f"{group}, {progress.left_s / 60:.0f} min left"
            bar.update(task, completed=progress.done, total=progress.total, description=left)

        return measure_all(conditions, list(seeds), path, tell, group, link)
