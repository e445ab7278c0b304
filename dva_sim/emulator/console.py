"""What the command line does with the emulated link: check it, and measure with it."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from dva_sim.emulator.campaign import Progress, measure_all
from dva_sim.emulator.cell import PACKETS, PROXY
from dva_sim.emulator.check import check_link
from dva_sim.emulator.running import EmulatorError, why_no_packets
from dva_sim.errors import ConfigError
from dva_sim.network.condition import Condition

console = Console(highlight=False, soft_wrap=True)
QUIET = "real-time priority, which root has, or a quiet machine helps"
OFFER = f"a relay of TCP ({PROXY}) measures here instead, without loss"


def check() -> int:
    """Print what is found about the emulated link; the exit code.

    Raises:
        EmulatorError: there is none here.
    """
    need_packets()
    findings = check_link()
    for finding in findings:
        _say(str(finding))
    if all(finding.passed for finding in findings):
        return 0
    _say("What is late only now and then waited for the processor: " + QUIET)
    return 1


def measure(
    conditions: Sequence[Condition], runs: int, out: Path, group: str = "own", link: str = PACKETS
) -> int:
    """Measure what the table does not hold yet and say how far it is; the exit code.

    Args:
        conditions: What to measure.
        runs: Of each.
        out: CSV file of the results.
        group: Name of this block of runs.
        link: `packets` or `proxy`.

    Raises:
        ConfigError: another link, or a file that cannot be taken up.
        EmulatorError: packets cannot be emulated here, or run after run fails.
    """
    if link not in (PACKETS, PROXY):
        raise ConfigError(f"link {link!r} is unknown; known: {PACKETS}, {PROXY}")
    if link == PACKETS:
        need_packets()
    failures = measure_all(conditions, range(1, runs + 1), out, _tell, group, link)
    for failure in failures:
        _say(failure)
    return 1 if failures else 0


def need_packets() -> None:
    """Go on where packets can be emulated.

    Raises:
        EmulatorError: they cannot: why, and what is there instead.
    """
    why = why_no_packets()
    if why:
        raise EmulatorError(f"{why}; {OFFER}")


def read_conditions(table: Path, cells: str = "") -> list[Condition]:
    """The different conditions of a table, in its order.

    Args:
        table: CSV file with the columns of conditions.
        cells: Only those whose label matches this regular expression.

    Raises:
        ConfigError: the table cannot be read, or nothing matches.
    """
    try:
        with table.open(encoding="utf-8", newline="") as file:
            found = dict.fromkeys(Condition.from_row(row) for row in csv.DictReader(file))
    except (OSError, UnicodeDecodeError, TypeError) as error:
        raise ConfigError(f"is no table of conditions: {error}", table) from None
    conditions = [condition for condition in found if re.search(cells, condition.label)]
    if not conditions:
        raise ConfigError(f"has no condition that matches {cells!r}", table)
    return conditions


def _tell(progress: Progress) -> None:
    words = f"{progress.done}/{progress.total}, {progress.left_s / 60:.0f} min left"
    _say("  ".join(filter(None, (words, progress.cell, progress.problem))))


def _say(line: str) -> None:
    console.print(line, markup=False)
