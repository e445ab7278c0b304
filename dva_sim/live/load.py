"""Load test of a DVA: processes with devices, their figures, and the load that breaks the DVA."""

from __future__ import annotations

import json
import math
import os
import socket
import subprocess
import sys
from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from dva_sim.kernel.errors import ConfigError
from dva_sim.live.load_devices import LONGEST, LoadShare
from dva_sim.live.supervisor import free_pairs
from dva_sim.network.addresses import check_address
from dva_sim.network.keys import create_keys
from dva_sim.options.runs import LiveOptions, LoadOptions
from dva_sim.serving.processes import Child, end_all
from dva_sim.simulation.full.stage import DVA, id_of

SCENARIO: Final = "drive-to-event"  # scenario of a DVA that is started here
SETTLE: Final = 3.0  # design: minimum time for all devices to join [s]
JOINS_PER_S: Final = 50.0  # design: rate at which devices join [1/s]
MAX_LATE_S: Final = 1.0  # design: 99th percentile of reply times beyond which the DVA is late [s]
MAX_LOST: Final = 0.01  # design: share of requests lost or refused that counts as broken
OF_DVA: Final = ("report", "list", "session")  # requests to the DVA; others go to robots
PERCENTILES: Final = (50.0, 99.0, 99.9)
Times = dict[str, list[float]]
MakeShares = Callable[[list[LoadShare]], list[dict[str, Any]]]


@dataclass(frozen=True)
class LoadFigures:
    """Figures of one step.

    Attributes:
        devices: Number of devices.
        sessions: Number of sessions.
        joined: Number of devices registered at the end.
        messages_per_s: Rate of publications and answered requests [1/s].
        requests_p50_s: Median time to a reply of the DVA [s]; other percentiles likewise.
        orders_p50_s: Median time from the report of an event to the first order [s].
        refused: Number of requests refused.
        lost: Number of requests without a reply.
        memory_mb: Memory of the DVA [MB]; nan if it runs on another machine.
        files: Open files of the DVA; nan if it runs on another machine.
        processor: Share of a core that the DVA used; nan if it runs on another machine.
        late_s: Longest delay of the load's own processes [s].
        broke: Reason why the DVA counts as broken or its state is unknown; empty otherwise.
    """

    devices: int
    sessions: int
    joined: int
    messages_per_s: float
    requests_p50_s: float
    requests_p99_s: float
    requests_p999_s: float
    commands_p50_s: float
    commands_p99_s: float
    commands_p999_s: float
    emergencies_p50_s: float
    emergencies_p99_s: float
    emergencies_p999_s: float
    orders_p50_s: float
    orders_p99_s: float
    orders_p999_s: float
    refused: int
    lost: int
    memory_mb: float
    files: float
    processor: float
    late_s: float
    broke: str = ""


def percentiles(name: str, times: Iterable[float]) -> dict[str, float]:
    """Return the percentiles of times [s] by column; nan without times."""
    values = np.percentile(list(times) or [math.nan], PERCENTILES)
    return {
        f"{name}_p{word}_s": float(value)
        for word, value in zip(("50", "99", "999"), values, strict=True)
    }


def order_times(
    reported: Iterable[tuple[str, float]], ordered: Iterable[tuple[str, float]]
) -> list[float]:
    """Return the time from each report to the next order for the same place [s]."""
    orders: Times = defaultdict(list)
    for place, time in sorted(ordered, key=lambda pair: pair[1]):
        orders[place].append(time)
    waits = []
    for place, time in sorted(reported, key=lambda pair: pair[1]):
        at = bisect_left(orders[place], time)
        if at < len(orders[place]):  # otherwise it was merged into an event with an order
            waits.append(orders[place].pop(at) - time)
    return waits


def figures_of(
    options: LoadOptions, devices: int, every: list[dict[str, Any]], dva: dict[str, float]
) -> LoadFigures:
    """Sum up the counts of the processes of one step.

    Args:
        options: Requested load.
        devices: Number of devices in this step.
        every: Counts of each process, as `LoadCounts`.
        dva: Memory, files and processor of the DVA.
    """
    trips: Times = defaultdict(list)
    for counts in every:
        for kind, times in counts["trips"].items():
            trips[kind] += times
    refused = sum((Counter(counts["refused"]) for counts in every), Counter[str]())
    lost = sum((Counter(counts["lost"]) for counts in every), Counter[str]())
    reported, ordered = (
        [pair for counts in every for pair in counts[name]] for name in ("reported", "ordered")
    )
    answered = sum(map(len, trips.values()))
    published = sum(counts["published"] for counts in every)
    of_dva = [time for kind in OF_DVA for time in trips[kind]]
    requests = percentiles("requests", of_dva)
    missed = refused.total() + lost.total()
    joined = sum(counts["joined"] for counts in every)
    late = max(counts["late"] for counts in every)
    slowest = requests["requests_p99_s"]
    n_requests = answered + lost.total()
    signs = {
        f"the load itself was late by {late:.2f} s, so take more processes": late > MAX_LATE_S / 2,
        f"p99 of replies {slowest:.2f} s": slowest > MAX_LATE_S,
        f"{missed} of {n_requests} requests lost or refused": missed > MAX_LOST * n_requests,
        f"{joined} of {devices} devices joined": joined < (1 - MAX_LOST) * devices,
    }
    return LoadFigures(
        devices=devices,
        sessions=options.sessions,
        joined=joined,
        messages_per_s=(answered + published) / options.duration,
        **requests,
        **percentiles("commands", trips["command"]),
        **percentiles("emergencies", trips["emergency"]),
        **percentiles("orders", order_times(reported, ordered)),
        refused=refused.total(),
        lost=lost.total(),
        **dva,
        late_s=late,
        broke="; ".join(sign for sign, is_there in signs.items() if is_there),
    )


class LoadedDva:
    """Resources that a DVA uses, as reported by the operating system.

    Args:
        pid: Process of the DVA; None if it runs on another machine.
    """

    def __init__(self, pid: int | None) -> None:
        self._process_folder = None if pid is None else Path(f"/proc/{pid}")

    @property
    def used_s(self) -> float:
        """Processor time used so far [s]; nan if it runs on another machine or has ended."""
        try:
            stat = self._read("stat").rpartition(")")[2].split()
        except OSError:
            return math.nan
        return (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")

    def look(self, used_s: float, over_s: float) -> dict[str, float]:
        """Return memory, open files and the share of a core used since an earlier time."""
        try:
            pages = int(self._read("statm").split()[1])
            files = len(list((self._process_folder or Path()).joinpath("fd").iterdir()))
        except OSError:
            return dict.fromkeys(("memory_mb", "files", "processor"), math.nan)
        memory = pages * os.sysconf("SC_PAGE_SIZE") / 1e6
        return {
            "memory_mb": memory,
            "files": float(files),
            "processor": (self.used_s - used_s) / over_s,
        }

    def _read(self, name: str) -> str:
        if self._process_folder is None:
            raise FileNotFoundError
        return (self._process_folder / name).read_text()


def run_load(options: LoadOptions, make_shares: MakeShares | None = None) -> Iterator[LoadFigures]:
    """Put load on a DVA; yield the figures of each step.

    Args:
        options: The load.
        make_shares: Function that runs all shares of a step and returns the counts of each; by
            default in processes of this machine.

    Raises:
        ConfigError: the address is none, or there are more sessions than devices.
        ChildFailed: a process ended by itself.
    """
    check(options)
    devices = options.devices
    _make_keys(options, devices)  # the DVA reads the keys when it starts
    with _dva(options) as (address, dva):
        while True:
            figures = _step(options, devices, address, dva, make_shares or make_here)
            yield figures
            if not options.until_it_breaks or figures.broke:
                return
            devices *= 2
            _make_keys(options, devices)


def check(options: LoadOptions) -> None:
    """Reject options of an impossible load.

    Raises:
        ConfigError: the address is none, or there are more sessions than devices.
    """
    if options.dva is not None:
        check_address(options.dva, "--dva ")
    if options.pid is not None and options.dva is None:
        raise ConfigError("--pid needs --dva: without it the process is known")
    needed = 2 * options.sessions + options.processes
    if needed > options.devices:
        raise ConfigError(
            f"--devices {options.devices}: {needed} are needed, two in each of {options.sessions} "
            f"sessions and one in each of {options.processes} processes"
        )


@contextmanager
def _dva(options: LoadOptions) -> Iterator[tuple[str, LoadedDva]]:
    """Yield the given DVA, or start one and end it afterwards."""
    if options.dva is not None:
        yield options.dva, LoadedDva(options.pid)
        return
    (port,) = free_pairs(1)
    address = f"{options.host}:{port}"
    keys = None if options.keys is None else options.keys.absolute()
    run = LiveOptions(SCENARIO, only="dva", no_page=True, dva=address, duration=LONGEST, keys=keys)
    part = {"part": "dva", "number": 1, "epoch": None, "outlet": None, "door": ()}
    about = json.dumps(part | {"options": vars(run)}, default=str)
    command = [sys.executable, "-m", "dva_sim.live", about]
    child = Child("the DVA", command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)
    try:
        child.ready(lambda: _listens(address))
        yield address, LoadedDva(child.pid)
    finally:
        end_all([child])


def _listens(address: str) -> bool | None:
    host, _, port = address.rpartition(":")
    try:
        socket.create_connection((host, int(port)), 0.5).close()
    except OSError:
        return None
    return True


def _make_keys(options: LoadOptions, devices: int) -> None:
    """Create missing keys of the devices, and of the DVA if it is started here."""
    if options.keys is not None:
        shares = _shares(options, devices, "")
        crew = [(kind, ns) for share in shares for kind, ns in share.numbers().items()]
        ids = [id_of(kind, n) for kind, ns in crew for n in ns]
        create_keys(options.keys, ids if options.dva is not None else [DVA, *ids])


def _shares(options: LoadOptions, devices: int, address: str) -> list[LoadShare]:
    count = options.processes
    settle = SETTLE + devices / JOINS_PER_S
    parts = [_part(whole, count) for whole in (devices, options.sessions)]
    return [
        LoadShare(
            dva=address,
            host=options.host if options.scheduler is None else "",
            number=number,
            devices=own,
            sessions=sessions,
            status_hz=options.status_hz,
            command_hz=options.command_hz,
            reports_hz=options.reports / 60 / count,
            churn_hz=options.churn / 60 / count,
            duration=options.duration,
            settle=settle,
            seed=options.seed,
            keys=None if options.keys is None else str(options.keys.absolute()),
        )
        for number, (own, sessions) in enumerate(zip(*parts, strict=True))
    ]


def _step(
    options: LoadOptions, devices: int, address: str, dva: LoadedDva, make_shares: MakeShares
) -> LoadFigures:
    shares = _shares(options, devices, address)
    before = dva.used_s
    counts = make_shares(shares)
    usage = dva.look(before, shares[0].settle + options.duration)
    return figures_of(options, devices, counts, usage)


def make_here(shares: list[LoadShare]) -> list[dict[str, Any]]:
    """Run the shares in processes of this machine; return the counts of each."""
    children = []
    pipe = subprocess.PIPE
    for share in shares:
        words = [sys.executable, "-m", "dva_sim.live.load_devices", json.dumps(asdict(share))]
        children.append(Child(f"load process {share.number}", words, stdin=pipe, stdout=pipe))
    try:
        return [json.loads(read_output(child)) for child in children]
    finally:
        end_all(children)


def read_output(child: Child) -> bytes:
    """Return the output of a process once it has ended.

    Raises:
        DvaSimError: the output is empty.
    """
    assert child.stdout is not None
    with child.stdout as pipe:
        text = pipe.read()
    if not text:
        child.wait()
        raise child.failure()
    return text


def _part(total: int, count: int) -> list[int]:
    """Divide a number among processes, as evenly as possible."""
    return [total // count + (number < total % count) for number in range(count)]
