"""Starts the parts of a live run as processes, listens to them, and ends them all."""

from __future__ import annotations

import json
import os
import selectors
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from dva_sim.kernel.errors import DvaSimError
from dva_sim.live.options import PATHS, ROSBRIDGE, changes_of, check
from dva_sim.live.process import Report
from dva_sim.live.recording import RunKeeping
from dva_sim.network.emulator.forwarder import FAR, NEAR
from dva_sim.network.emulator.process import ADDRESSES, LinkEnded, LinkProcess
from dva_sim.network.emulator.report import LinkReport
from dva_sim.options.runs import LiveOptions
from dva_sim.serving.open_port import OpenPort
from dva_sim.serving.pipes import PipeEnd
from dva_sim.serving.processes import Child, ChildFailed, end_all
from dva_sim.serving.signals import caught_signals
from dva_sim.simulation.full.verdicts import Verdict, broken_rules
from dva_sim.simulation.scenario import Scenario

if TYPE_CHECKING:
    from dva_sim.live.foxglove_server import FoxgloveServer

SPEAK_WITHIN = 60.0  # maximum time to the first report of a part and between two [s]
SETTLED_FOR = 3.0  # time without activity of any part that ends the run [s]
LOOK = 0.5  # interval of checks whether all parts are alive [s]


@dataclass
class _Part:
    """A running part: its process and its last report.

    Attributes:
        may_die: True for a DVA that other DVAs can replace.
        is_dead: True once such a DVA has ended by itself.
    """

    child: Child
    reports: PipeEnd
    latest: Report | None = None
    heard: float = field(default_factory=time.monotonic)
    may_die: bool = False
    is_dead: bool = False


@dataclass
class Summary:
    """Outcome of a live run.

    Attributes:
        why: `settled`, `the script is done`, `time is up` or `interrupted`.
        latest: Last report of each part, by its name.
        lost: Line on lost recordings; None if nothing was lost.
        verdicts: Verdicts on the safety rules.
        link: Packet counts of the emulated link, if there was one.
    """

    why: str
    latest: dict[str, Report] = field(default_factory=dict)
    lost: str | None = None
    verdicts: list[Verdict] = field(default_factory=list)
    link: LinkReport | None = None


class Supervisor:
    """One live run.

    Args:
        options: Scenario and other options.
        hear: Callback for each report of each part.
        rosbridge: Port for clients of ROS, if any.
        foxglove: Server that shows the run in Foxglove, if any.
    """

    def __init__(
        self,
        options: LiveOptions,
        hear: Callable[[str, Report], object],
        rosbridge: OpenPort | None = None,
        foxglove: FoxgloveServer | None = None,
    ) -> None:
        self._foxglove = foxglove
        self._options = options
        self._hear = hear
        self._rosbridge = rosbridge
        self._parts: list[_Part] = []
        self._selector = selectors.DefaultSelector()
        self._epoch = time.monotonic()
        self._interrupted = False
        self._settled_since: float | None = None
        self._keeping: RunKeeping | None = None
        self._link: LinkProcess | None = None
        self._packets: LinkReport | None = None

    def run(self) -> Summary:
        """Start all parts, wait for the end of the run, and end all parts.

        Raises:
            ChildFailed: a part could not start, or ended by itself.
            ConfigError: the scenario cannot be run live.
        """
        scenario = check(self._options)
        keeping = self._keeping = RunKeeping(
            self._options, scenario, None if self._foxglove is None else self._foxglove.keep
        )
        try:
            why = self._run(scenario)
        except DvaSimError as error:
            reports = [str(error), keeping.finish() or "", broken_rules(keeping.verdicts())]
            raise type(error)("; ".join(filter(None, reports))) from None
        latest = {p.child.name: p.latest for p in self._parts if p.latest}
        lost = keeping.finish()
        return Summary(why, latest, lost, keeping.verdicts(), self._packets)

    def _run(self, scenario: Scenario) -> str:
        limit = scenario.horizon_s if self._options.duration is None else self._options.duration
        with caught_signals() as signals:
            self._selector.register(signals, selectors.EVENT_READ)
            try:
                self._start_all(scenario)
                return self._watch(limit)
            finally:
                self._end_all()
                if self._link is not None:
                    with suppress(LinkEnded):
                        self._packets = self._link.report()
                    self._link.close()

    def _start_all(self, scenario: Scenario) -> None:
        """Start all parts, the DVA first, as the others need its address."""
        if self._options.link:
            self._link = LinkProcess(scenario.link, self._options.seed)
            self._link.begin()
        first = self._options.port
        address = self._start_dvas(scenario, self._options.dva)
        if address is not None:
            ports = _ports(first, scenario)
            self._start("world", "world", address, port=next(ports))
            for number in range(1, scenario.operator.count + 1):
                self._start(f"operator-{number}", "operator", address, number, next(ports))
            if self._rosbridge is not None:
                self._start(ROSBRIDGE, ROSBRIDGE, address)

    def _start_dvas(self, scenario: Scenario, dva: str | None) -> str | None:
        """Start the DVAs, one per region; return their addresses, separated by commas."""
        first = self._options.port
        regions = scenario.dva.regions
        if not regions:
            self._start("dva", "dva", dva, port=first)
            return self._address_of_dva()
        host = self._options.host
        ports = [first + 2 * n for n in range(len(regions))] if first else free_pairs(len(regions))
        dva = dva or ",".join(f"{host}:{port}" for port in ports)
        for number, name in enumerate(regions, 1):
            self._start(f"dva-{name}", "dva", dva, number)
            self._parts[-1].may_die = True
            while not self._interrupted and self._parts[-1].latest is None:
                self._listen()  # so that their addresses are reported in order
        return None if self._interrupted else dva

    def _start(self, name: str, part: str, dva: str | None, number: int = 1, port: int = 0) -> None:
        """Start a part, which ends with its standard input even if this process is killed."""
        assert self._keeping is not None
        outlet = self._keeping.inlet()
        door = self._rosbridge.passed() if self._rosbridge and part == ROSBRIDGE else ()
        arguments = self._arguments(part, dva, number, port, outlet, door)
        words = [sys.executable, "-m", "dva_sim.live", arguments]
        reads, writes = os.pipe()
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": writes}
        pipes["pass_fds"] = outlet, *door
        if self._link is None:
            child = Child(name, words, **pipes)
        else:
            child = self._link.start(_end_of(part), words, name, keeps_errors=True, **pipes)
        for file in (outlet, writes, *door[1:]):
            os.close(file)
        started = _Part(child, PipeEnd(reads))
        self._parts.append(started)
        self._selector.register(reads, selectors.EVENT_READ, started)

    def _arguments(
        self,
        part: str,
        dva: str | None,
        number: int,
        port: int,
        outlet: int,
        door: tuple[int, ...],
    ) -> str:
        values = {**vars(self._options), "dva": dva, "port": port}
        values |= {"set": changes_of(self._options), "link": ()}  # files are read only here
        values["shows_run"] = self._foxglove is not None
        if self._link is not None:
            values["host"] = ADDRESSES[_end_of(part)]
        for key in PATHS:
            values[key] = None if values[key] is None else str(values[key])
        about = {
            "part": part,
            "number": number,
            "epoch": self._epoch,
            "outlet": outlet,
            "door": door,
        }
        return json.dumps(about | {"options": values})

    def _address_of_dva(self) -> str | None:
        """Wait for the DVA's address; return None if the user ends the run before."""
        while not self._interrupted:
            self._listen()
            latest = self._parts[0].latest
            if latest is not None and latest.dva is not None:
                return latest.dva
        return None

    def _watch(self, limit: float) -> str:
        while not self._interrupted:
            self._listen()
            if time.monotonic() - self._epoch > limit or self._some_are_done():
                return "time is up"
            if self._all_settled():
                return "the script is done" if self._options.operators == "scripted" else "settled"
        return "interrupted"

    def _some_are_done(self) -> bool:
        """Return True if a part has ended normally, since the time of the run is up."""
        return any(part.child.poll() == 0 for part in self._parts)

    def _all_settled(self) -> bool:
        reports = [part.latest for part in self._parts if not part.is_dead]
        if not all(report is not None and report.settled for report in reports):
            self._settled_since = None
            return False
        if self._settled_since is None:
            self._settled_since = time.monotonic()
        return time.monotonic() - self._settled_since > SETTLED_FOR

    def _listen(self) -> None:
        """Read reports of the parts, waiting at most for `LOOK`.

        Raises:
            ChildFailed: a part has ended unexpectedly.
            LinkEnded: the emulated link has ended unexpectedly.
            DvaSimError: a part has rejected its options.
        """
        self._read(LOOK)
        self._tell_broken_rules()
        if self._link is not None and self._link.has_ended:
            raise self._link.ended()
        for part in self._parts:
            code = part.child.poll()
            if code and not self._interrupted:
                self._bury(part)
            if code is None and time.monotonic() - part.heard > SPEAK_WITHIN:
                raise ChildFailed(f"{part.child.name} has said nothing for {SPEAK_WITHIN:g} s")

    def _bury(self, part: _Part) -> None:
        """Continue without a DVA that has ended, as long as another one runs.

        Raises:
            ChildFailed: another part has ended, or all DVAs have.
        """
        dvas = [dva for dva in self._parts if dva.may_die and dva is not part]
        if not part.may_die or all(dva.is_dead for dva in dvas):
            raise part.child.failure()
        if not part.is_dead:
            part.is_dead = True
            now = time.monotonic() - self._epoch
            self._tell("dva", [[now, part.child.name, "has ended; the others go on", "link"]])

    def _tell_broken_rules(self) -> None:
        """Report new breaches of safety rules."""
        moments = [list(moment) for moment in self._keeping.news()] if self._keeping else []
        self._tell("rules", moments)

    def _tell(self, part: str, story: list[list[Any]]) -> None:
        """Report lines of the timeline that come from the supervisor itself."""
        if story:
            now = time.monotonic() - self._epoch
            self._hear(
                part,
                Report(
                    part=part,
                    number=0,
                    time=now,
                    rows=[],
                    events=[],
                    story=story,
                    counters={},
                    settled=True,
                    dva=None,
                    lateness=0.0,
                ),
            )

    def _read(self, wait: float) -> bool:
        """Read available data, waiting up to `wait` [s]; return False if there was none."""
        ready = self._selector.select(wait)
        for key, _ in ready:
            if isinstance(key.fileobj, socket.socket):
                key.fileobj.recv(64)
                self._interrupted = True
            else:
                self._take_reports(key.data)
        return bool(ready)

    def _take_reports(self, part: _Part) -> None:
        for line in part.reports.lines():
            part.latest = Report(**line)
            part.heard = time.monotonic()
            self._hear(part.child.name, part.latest)
        if not part.reports.is_open:
            self._selector.unregister(part.reports)

    def _end_all(self) -> None:
        """End all parts, operators first."""
        end_all([part.child for part in reversed(self._parts)], meanwhile=self._read)
        while self._read(0.0):
            pass
        self._selector.close()
        for part in self._parts:
            part.reports.close()


def free_pairs(count: int) -> list[int]:
    """Return the first ports of `count` pairs of free ports."""
    sockets: list[socket.socket] = []
    pairs: list[int] = []
    try:
        while len(pairs) < count:
            sockets.append(socket.create_server(("", 0)))
            port = sockets[-1].getsockname()[1]
            with suppress(OSError):
                sockets.append(socket.create_server(("", port + 1)))
                pairs.append(port)
    finally:
        for each in sockets:
            each.close()
    return pairs


def _end_of(part: str) -> str:
    """Return the end of an emulated link at which a part runs; robots are at the far end."""
    return FAR if part == "world" else NEAR


def _ports(first: int, scenario: Scenario) -> Iterator[int]:
    """Yield the first ports of the world and of each operator, after the DVAs'; 0 for any."""
    in_world = scenario.robot.count + scenario.guard.count + len(scenario.events)
    dvas = max(1, len(scenario.dva.regions))
    devices = dvas
    while True:
        yield first + 2 * devices if first else 0
        devices += in_world if devices == dvas else 1
