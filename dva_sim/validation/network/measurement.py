"""Measuring on real sockets: the whole design into a table, or some of it to look at now."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.network.emulator.cell import PACKETS
from dva_sim.validation.network.emulator.measuring import Progress, measure_all
from dva_sim.validation.network.reference import (
    BlockConfig,
    SocketRun,
    SourceConfig,
    conditions_of,
    read_runs,
)

QUICK_S = 12.0  # measured of each condition; enough for twenty commands in nearly all


Tell = Callable[[str, Progress], None]
"""Hears which block is measured, and how far it is."""


def measure_design(blocks: Sequence[BlockConfig], path: Path, tell: Tell) -> list[str]:
    """Measure what a design wants and a table does not hold yet; what failed, a line each.

    Raises:
        ConfigError: the table cannot be written, or holds something else.
        EmulatorError: the emulated link cannot be set up here.
    """
    return [
        problem
        for block in blocks
        for problem in measure_all(
            conditions_of(block),
            list(range(1, block.seeds + 1)),
            path,
            partial(tell, block.group),
            block.group,
            PACKETS,
        )
    ]


def measure_now(
    blocks: Sequence[BlockConfig], path: Path, quick: bool, link: str, tell: Tell
) -> tuple[list[SocketRun], list[str]]:
    """Measure each condition of a design once; the runs, and what failed, a line each.

    Args:
        blocks: The design.
        path: A new table.
        quick: One pair of programs for each link, and a short time.
        link: What the programs are joined by; a relay can neither lose nor reorder packets, so
            that only conditions without loss are measured.
        tell: Hears how far it is.

    Raises:
        ConfigError: the table is there already, or cannot be written.
        EmulatorError: nothing can be measured here.
    """
    if path.exists():
        raise ConfigError("is there already; --live measures afresh: remove it first", str(path))
    problems: list[str] = []
    for block in blocks:
        conditions = shortened(block) if quick else conditions_of(block)
        some = [c for c in conditions if link == PACKETS or not (c.loss or c.reorder)]
        hear = partial(tell, block.group)
        problems += measure_all(some, [1], path, hear, block.group, link)
    return read_runs("live", SourceConfig(file=str(path), made_with={})), problems


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
