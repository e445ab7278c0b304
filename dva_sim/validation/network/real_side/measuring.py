"""Real TCP and ZeroMQ measured: real programs over the emulated link, many conditions, many times.

The whole design goes into a table, or some of it is measured to look at now. A measurement can be
stopped, killed and taken up again: its table grows by whole rows, also when its writer is killed.
Beside it stands the machine it was made on, as far as a reader needs that.
"""

from __future__ import annotations

import csv
import dataclasses
import fcntl
import gzip
import io
import json
import math
import os
import platform
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import zmq

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import derive_seed
from dva_sim.network.emulator.needs import EmulatorError
from dva_sim.network.pattern_runs import EMULATOR_RESULTS, RESULTS, Condition, RunLog, measure_log
from dva_sim.validation.network.real_side.cell import (
    PACKETS,
    EmulatedJob,
    refuse_for_proxy,
    run_job,
)
from dva_sim.validation.network.real_side.programs import HANDSHAKE_LIMIT_S
from dva_sim.validation.network.reference import (
    BlockConfig,
    SocketRun,
    SourceConfig,
    conditions_of,
    read_runs,
)

Machine = dict[str, str | int | bool | None]


def describe_machine(link: str) -> Machine:
    """Return versions, clock and processor; no names of machines, people or folders.

    A run of nothing shows what the machine allows: how the namespaces were made, and whether
    real-time priority was granted.

    Args:
        link: `packets` or `proxy`.

    Raises:
        EmulatorError: the link cannot be set up.
    """
    outcome = run_job(EmulatedJob("nothing", link=link))
    return {
        "kernel": f"{platform.system()} {platform.release()}",
        "timer_hz": _timer_hz(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "pyzmq": zmq.pyzmq_version(),
        "libzmq": zmq.zmq_version(),
        "link": link,
        "namespaces": outcome.way,
        "realtime": outcome.realtime,
    }


def _timer_hz() -> int | None:
    """Return the kernel's timer frequency [Hz], where its configuration can be read."""
    text = ""
    with suppress(OSError):
        text = gzip.decompress(Path("/proc/config.gz").read_bytes()).decode()
    with suppress(OSError):
        text = text or Path(f"/boot/config-{platform.release()}").read_text(encoding="utf-8")
    match = re.search(r"^CONFIG_HZ=(\d+)$", text, re.MULTILINE)
    return int(match[1]) if match else None


def _processor() -> str | None:
    with suppress(OSError):
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        match = re.search(r"^model name\s*: (.*)$", text, re.MULTILINE)
        return match[1] if match else None
    return None


Row = dict[str, str]
_DECIMALS = 4
COLUMNS = (*Condition("pub", 1).to_row(), *RESULTS, *EMULATOR_RESULTS, "realtime")
"""Contents of a measurement: condition, results, emulator, real-time priority."""


def measure(condition: Condition, seed: int, link: str = PACKETS) -> Row:
    """Run a condition once on real sockets.

    Args:
        seed: Seed of the link's random numbers, together with the condition: no two conditions
            share them.
        link: `packets`, or `proxy` where namespaces are forbidden.

    Returns:
        The columns `COLUMNS` as a table holds them; empty where a result is not defined.

    Raises:
        EmulatorError: the run failed, or this link cannot do what the condition asks.
    """
    job = make_job(condition, seed, link)
    refuse_for_proxy(job)
    outcome = run_job(job)
    log = RunLog.of([*outcome.operator, *outcome.robot])
    results = measure_log(log, condition.warm_s, condition.dur_s) | outcome.link
    if condition.pattern != "req-rep":
        results |= {"timeouts": math.nan, "alerts": math.nan}
    written = {
        name: "" if math.isnan(value) else f"{round(value, _DECIMALS):.10g}"
        for name, value in results.items()
    }
    row = condition.to_row() | written | {"realtime": str(int(outcome.realtime))}
    return {name: row[name] for name in COLUMNS}


def make_job(condition: Condition, seed: int, link: str = PACKETS) -> EmulatedJob:
    """Make the job for the process of one run."""
    played_s = condition.warm_s + condition.dur_s
    return EmulatedJob(
        "commands",
        condition.link(),
        derive_seed(condition.hash, seed),
        bound_s=HANDSHAKE_LIMIT_S + condition.subscription_wait_s + played_s + 10.0,
        arguments=dataclasses.asdict(condition),
        congestion=condition.cc,
        link=link,
    )


class Table(AbstractContextManager["Table"]):
    """A CSV file of one campaign, and beside it the machine it was measured on.

    A row is one write that is forced to the disk; what a killed writer left of a row is cut off
    when the file is opened again. Only one campaign can write to it.

    Args:
        path: The file; made if it is not there.
        columns: Columns of the table.

    Raises:
        ConfigError: it cannot be written, has other columns, or another campaign writes to it.
    """

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self.path = path
        self.columns = tuple(columns)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        except OSError as error:
            raise ConfigError(f"cannot be written: {error.strerror}", path) from None
        try:
            self.rows = self._take_over()
        except BaseException:
            os.close(self._file)
            raise

    def __exit__(self, *error: object) -> None:
        os.close(self._file)

    def append(self, row: Mapping[str, str]) -> None:
        """Add a row."""
        self._write([row[column] for column in self.columns])
        self.rows.append(dict(row))

    def sign(self, machine: Mapping[str, Any]) -> None:
        """Say which machine measures.

        Raises:
            ConfigError: rows of another one are there already.
        """
        beside = self.path.with_suffix(".machine.json")
        if self.rows and beside.exists():
            signed = json.loads(beside.read_text(encoding="utf-8"))
            other = [name for name in machine if signed.get(name) != machine[name]]
            if other:
                text = ", ".join(f"{n} was {signed.get(n)}, is {machine[n]}" for n in other)
                raise ConfigError(f"was measured elsewhere ({text}): begin another file", self.path)
        beside.write_text(json.dumps(machine, indent=1) + "\n", encoding="utf-8")

    def _take_over(self) -> list[dict[str, str]]:
        """Lock the file, cut off half a row, write the header where it is new; its rows."""
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ConfigError("is being written by another campaign", self.path) from None
        content = self.path.read_bytes()
        whole = content.rfind(b"\n") + 1
        os.ftruncate(self._file, whole)
        if not whole:
            self._write(self.columns)
            return []
        reader = csv.DictReader(io.StringIO(content[:whole].decode()))
        if tuple(reader.fieldnames or ()) != self.columns:
            raise ConfigError("is not a table of measurements: other columns", self.path)
        return list(reader)

    def _write(self, values: Sequence[str]) -> None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(values)
        os.write(self._file, text.getvalue().encode())
        os.fsync(self._file)


_IDENTITY = ("cell", "group", "seed", "cond_id")
_OVERHEAD_S = 1.5  # processes, handshake and waiting, about
_MAX_FAILURES = 3  # maximum consecutive failures


@dataclass(frozen=True)
class Progress:
    """Progress of a campaign.

    Attributes:
        done: Rows that are there.
        total: Number of rows to measure.
        left_s: About the time it still takes [s].
    """

    done: int
    total: int
    left_s: float


def measure_all(
    conditions: Sequence[Condition],
    seeds: Sequence[int],
    path: Path,
    tell: Callable[[Progress], object] = lambda progress: None,
    group: str = "own",
    link: str = PACKETS,
) -> list[str]:
    """Measure every condition with every seed that the table does not hold yet.

    All conditions come once before any comes twice, so that a table cut short is a fair one.

    Args:
        seeds: Seed of each run; together with the condition it decides the random numbers.
        path: CSV file of the results.
        tell: Callback at the beginning and after every run.
        group: Name for the column `group`.
        link: `packets` or `proxy`.

    Returns:
        A line for each run that could not be measured.

    Raises:
        ConfigError: the file cannot be written, or holds something else.
        EmulatorError: the link cannot be set up, or fails again and again.
    """
    machine = describe_machine(link)
    plan = [(condition, seed) for seed in seeds for condition in conditions]
    failures = list[str]()
    in_a_row = 0
    with Table(path, (*_IDENTITY, *COLUMNS)) as table:
        table.sign(machine)
        done_keys = {(row["cond_id"], row["seed"]) for row in table.rows}
        left = [(c, s) for c, s in plan if (c.hash, str(s)) not in done_keys]
        done = len(plan) - len(left)
        tell(Progress(done, len(plan), _time_of(left)))
        for turn, (condition, seed) in enumerate(left, start=1):
            cell = f"{group}_{condition.label}_s{seed}"
            identity = dict(zip(_IDENTITY, (cell, group, str(seed), condition.hash), strict=True))
            try:
                table.append(identity | measure(condition, seed, link))
                done += 1
                in_a_row = 0
            except EmulatorError as error:
                failures.append(f"{cell}: {error}")
                in_a_row += 1
                if in_a_row == _MAX_FAILURES:
                    raise
            tell(Progress(done, len(plan), _time_of(left[turn:])))
    return failures


def _time_of(left: Sequence[tuple[Condition, int]]) -> float:
    return sum(c.warm_s + c.dur_s + 8e-3 * c.delay_ms + _OVERHEAD_S for c, _ in left)


QUICK_S = 12.0  # measured time of each condition, mostly enough for 20 commands [s]


Tell = Callable[[str, Progress], None]
"""Hears which block is measured, and how far it is."""


def measure_design(blocks: Sequence[BlockConfig], path: Path, tell: Tell) -> list[str]:
    """Measure the runs of a design that are missing in a table; return a line per failure.

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
    """Measure each condition of a design once; return the runs, and a line per failure.

    Args:
        blocks: The design.
        path: A new table.
        quick: One pair of programs for each link, and a short time.
        link: Link between the programs. A relay can neither lose nor reorder packets, so only
            conditions without loss are measured.
        tell: Hears how far it is.

    Raises:
        ConfigError: the table is there already, or cannot be written.
        EmulatorError: nothing can be measured here.
    """
    if path.exists():
        raise ConfigError(
            "already exists; --live starts a new measurement, so remove it first", str(path)
        )
    problems: list[str] = []
    for block in blocks:
        conditions = shortened(block) if quick else conditions_of(block)
        some = [c for c in conditions if link == PACKETS or not (c.loss or c.reorder)]
        hear = partial(tell, block.group)
        problems += measure_all(some, [1], path, hear, block.group, link)
    return read_runs("live", SourceConfig(file=str(path), made_with={})), problems


def made_with(path: Path) -> str:
    """Describe the machine that a table was measured on."""
    machine = json.loads(path.with_suffix(".machine.json").read_text(encoding="utf-8"))
    return "; ".join(f"{name} {value}" for name, value in machine.items())


def shortened(block: BlockConfig) -> list[Condition]:
    """Return each link once, with programs by turns, measured for a short time."""
    names = list(block.programs)
    conditions = []
    for turn, link in enumerate(block.links):
        programs = names[turn % len(names)]
        changes = {
            "links": {link: block.links[link]},
            "programs": {programs: block.programs[programs]},
            "settings": {**block.settings, "dur_s": QUICK_S},
        }
        conditions += conditions_of(block.model_copy(update=changes))
    return conditions
