"""Load on a DVA: processes with devices, what they found, and where the DVA breaks."""

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

SCENARIO: Final = "drive-to-event"  # whose site the DVA that is started knows
SETTLE: Final = 3.0  # design: for all to join, and more for many [s]
JOINS_PER_S: Final = 50.0  # design: devices that join in a second
MAX_LATE_S: Final = 1.0  # design: the 99th percentile of the DVA's replies that counts as late
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
        messages_per_s: Publications and answered requests in a second.
        requests_p50_s: Median time of the DVA's replies [s]; likewise the others.
        orders_p50_s: Median time from the report of an event to the first order [s].
        refused: Number of requests refused.
        lost: Number of requests without a reply.
        memory_mb: Memory of the DVA [MB]; nan if it is not here.
        files: Open files of the DVA; nan if it is not here.
        processor: Share of one core that the DVA used; nan if it is not here.
        late_s: Longest time that the processes of the load were late themselves [s].
        broke: Reason why the DVA counts as broken, or nothing is known of it; empty while it holds.
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
    """Return the percentiles of some times [s] by column; nan without any."""
    values = np.percentile(list(times) or [math.nan], PERCENTILES)
    return {
        f"{name}_p{word}_s": float(value)
        for word, value in zip(("50", "99", "999"), values, strict=True)
    }


def order_times(
    reported: Iterable[tuple[str, float]], ordered: Iterable[tuple[str, float]]
) -> list[float]:
    """Return the times from reports to the first order to their places after them [s]."""
    orders: Times = defaultdict(list)
    for place, time in sorted(ordered, key=lambda pair: pair[1]):
        orders[place].append(time)
    waits = []
    for place, time in sorted(reported, key=lambda pair: pair[1]):
        at = bisect_left(orders[place], time)
        if at < len(orders[place]):  # else it became part of an event that had an order
            waits.append(orders[place].pop(at) - time)
    return waits


def figures_of(
    options: LoadOptions, devices: int, every: list[dict[str, Any]], dva: dict[str, float]
) -> LoadFigures:
    """Sum up the counts of the processes of one step.

    Args:
        options: Load that was asked for.
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
    """A DVA as the system sees its process.

    Args:
        pid: Its process; None: it is elsewhere.
    """

    def __init__(self, pid: int | None) -> None:
        self._here = None if pid is None else Path(f"/proc/{pid}")

    @property
    def used_s(self) -> float:
        """Processor time that it has used [s]; nan if it is elsewhere, or has ended."""
        try:
            stat = self._read("stat").rpartition(")")[2].split()
        except OSError:
            return math.nan
        return (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")

    def look(self, used_s: float, over_s: float) -> dict[str, float]:
        """Return memory, files and the share of a core since it had used so much."""
        try:
            pages = int(self._read("statm").split()[1])
            files = len(list((self._here or Path()).joinpath("fd").iterdir()))
        except OSError:
            return dict.fromkeys(("memory_mb", "files", "processor"), math.nan)
        memory = pages * os.sysconf("SC_PAGE_SIZE") / 1e6
        return {
            "memory_mb": memory,
            "files": float(files),
            "processor": (self.used_s - used_s) / over_s,
        }

    def _read(self, name: str) -> str:
        if self._here is None:
            raise FileNotFoundError
        return (self._here / name).read_text()


def run_load(options: LoadOptions, make_shares: MakeShares | None = None) -> Iterator[LoadFigures]:
    """Put load on a DVA; yield the figures of each step.

    Args:
        options: The load.
        make_shares: Function that makes the shares of a step at once, and returns the counts of
            each; default: in processes of this machine.

    Raises:
        ConfigError: the address is none, or there are more sessions than devices.
        ChildFailed: a process ended by itself.
    """
    check(options)
    devices = options.devices
    _make_keys(options, devices)  # before the DVA reads them
    with _dva(options) as (address, dva):
        while True:
            figures = _step(options, devices, address, dva, make_shares or make_here)
            yield figures
            if not options.until_it_breaks or figures.broke:
                return
            devices *= 2
            _make_keys(options, devices)


def check(options: LoadOptions) -> None:
    """Refuse a load that cannot be made.

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
    """Yield the DVA that was named, or one that is started and ended."""
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
    """Make the missing keys of the devices, and of the DVA if it is started here."""
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
    every = make_shares(shares)
    looked = dva.look(before, shares[0].settle + options.duration)
    return figures_of(options, devices, every, looked)


def make_here(shares: list[LoadShare]) -> list[dict[str, Any]]:
    """Make the shares in processes of this machine; return the counts of each."""
    children = []
    pipe = subprocess.PIPE
    for share in shares:
        words = [sys.executable, "-m", "dva_sim.live.load_devices", json.dumps(asdict(share))]
        children.append(Child(f"load process {share.number}", words, stdin=pipe, stdout=pipe))
    try:
        return [json.loads(said(child)) for child in children]
    finally:
        end_all(children)


def said(child: Child) -> bytes:
    """Return what a process has said once it ends.

    Raises:
        DvaSimError: nothing.
    """
    assert child.stdout is not None
    with child.stdout as pipe:
        text = pipe.read()
    if not text:
        child.wait()
        raise child.failure()
    return text


def _part(whole: int, count: int) -> list[int]:
    """Share a number among processes."""
    return [whole // count + (number < whole % count) for number in range(count)]
