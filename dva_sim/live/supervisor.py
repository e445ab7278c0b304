"""Starts the parts of a live run as processes, listens to them, and ends them all."""

from __future__ import annotations

import json
import os
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import IO, TYPE_CHECKING, Any

from dva_sim.kernel.errors import ERROR, DvaSimError, ExitCode, RunsFailed
from dva_sim.live.options import PATHS, ROSBRIDGE, LiveOptions
from dva_sim.live.process import Report
from dva_sim.live.recording import RunKeeping
from dva_sim.network.carriers import DEFAULT_PORT, free_port
from dva_sim.network.emulator.forwarder import FAR, NEAR
from dva_sim.network.emulator.process import ADDRESSES, LinkEnded, LinkProcess
from dva_sim.network.emulator.report import LinkReport
from dva_sim.serving.open_port import OpenPort
from dva_sim.simulation.full.verdicts import Verdict, broken_rules
from dva_sim.simulation.scenario import Scenario

if TYPE_CHECKING:
    from dva_sim.live.foxglove_server import FoxgloveServer

SPEAK_WITHIN = 60.0  # for a part to speak, from its start and after each time [s]
END_WITHIN = 5.0  # for a part to end by itself once it is asked to [s]
SETTLED_FOR = 3.0  # all parts settled for so long: the run is over [s]
LOOK = 0.5  # between looks at whether all parts are still there [s]


class PartFailed(RunsFailed):
    """A part ended before it was asked to."""


@dataclass
class _Child:
    """A part that runs: its process, and what it said last."""

    name: str
    process: subprocess.Popen[bytes]
    buffer: bytes = b""
    errors: bytes = b""
    latest: Report | None = None
    heard: float = field(default_factory=time.monotonic)


@dataclass
class Summary:
    """Outcome of a live run.

    Attributes:
        why: `settled`, `the script is done`, `time is up` or `interrupted`.
        latest: The last report of each part, by its name.
        lost: Recording that was lost, in one line; None: nothing.
        verdicts: Verdicts on the safety rules.
        link: The packets of the emulated link, if there was one.
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
        rosbridge: Port for clients of ROS; None: there is none.
        foxglove: Server that shows the run; None: there is none.
    """

    def __init__(
        self,
        options: LiveOptions,
        hear: Callable[[str, Report], object],
        rosbridge: OpenPort | None = None,
        foxglove: FoxgloveServer | None = None,
    ) -> None:
        self._foxglove = foxglove
        self._options, self._hear, self._rosbridge = options, hear, rosbridge
        self._children: list[_Child] = []
        self._selector = selectors.DefaultSelector()
        self._epoch = time.monotonic()
        self._interrupted = False
        self._settled_since: float | None = None
        self._keeping: RunKeeping | None = None
        self._link: LinkProcess | None = None
        self._packets: LinkReport | None = None

    def run(self) -> Summary:
        """Start everything, wait for the end, end everything.

        Raises:
            PartFailed: a part could not start, or ended by itself.
            ConfigError: the scenario cannot be run live.
        """
        scenario = self._options.check()
        keeping = self._keeping = RunKeeping(
            self._options, scenario, None if self._foxglove is None else self._foxglove.keep
        )
        try:
            why = self._run(scenario)
        except DvaSimError as error:
            reports = [str(error), keeping.finish() or "", broken_rules(keeping.verdicts())]
            raise type(error)("; ".join(filter(None, reports))) from None
        latest = {c.name: c.latest for c in self._children if c.latest}
        lost = keeping.finish()
        return Summary(why, latest, lost, keeping.verdicts(), self._packets)

    def _run(self, scenario: Scenario) -> str:
        limit = scenario.horizon_s if self._options.duration is None else self._options.duration
        before = {
            number: signal.signal(number, self._interrupt)
            for number in (signal.SIGINT, signal.SIGTERM)
        }
        try:
            if self._options.emulated:
                self._link = LinkProcess(scenario.link, self._options.seed)
                self._link.begin()
            first, dva = self._options.port, self._options.dva
            if self._options.carrier.is_mqtt:
                first, dva = 0, dva or self._address_of_broker()
            self._start("dva", "dva", dva, port=first)
            address = self._address_of_dva()
            if address is not None:
                ports = _ports(first, scenario)
                self._start("world", "world", address, port=next(ports))
                for number in range(1, scenario.operator.count + 1):
                    self._start(f"operator-{number}", "operator", address, number, next(ports))
                if self._rosbridge is not None:
                    self._start(ROSBRIDGE, ROSBRIDGE, address)
            return self._watch(limit)
        finally:
            self._end_all()
            self._end_link()
            for number, handler in before.items():
                signal.signal(number, handler)

    def _interrupt(self, *_: object) -> None:
        self._interrupted = True

    def _start(self, name: str, part: str, dva: str | None, number: int = 1, port: int = 0) -> None:
        """Start a part; it ends when its standard input does, whatever happens to us."""
        assert self._keeping is not None
        outlet = self._keeping.inlet()
        door = self._rosbridge.passed() if self._rosbridge and part == ROSBRIDGE else ()
        arguments = self._arguments(part, dva, number, port, outlet, door)
        words = [sys.executable, "-m", "dva_sim.live", arguments]
        passed = outlet, *door
        pipes: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
        if self._link is None:
            # In a new session Ctrl-C reaches us alone; we end the parts in good order.
            process = subprocess.Popen(words, start_new_session=True, pass_fds=passed, **pipes)
        else:
            process = self._link.start(_end_of(part), words, pass_fds=passed, **pipes)
        for file in (outlet, *door[1:]):
            os.close(file)
        child = _Child(name, process)
        self._children.append(child)
        for stream, take in ((process.stdout, self._take_line), (process.stderr, self._take_error)):
            assert stream is not None
            os.set_blocking(stream.fileno(), False)
            self._selector.register(stream, selectors.EVENT_READ, (child, take))

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

    def _address_of_broker(self) -> str:
        """Return where the broker of MQTT, and so every device, will be found."""
        host, port = self._options.host, self._options.port
        if self._link is not None:
            return f"{ADDRESSES[self._options.carrier.mqtt.broker]}:{port or DEFAULT_PORT}"
        return f"{host}:{port or free_port(host)}"

    def _address_of_dva(self) -> str | None:
        """Return the DVA's address once it listens; None if the user ends the run before."""
        deadline = time.monotonic() + SPEAK_WITHIN
        while not self._interrupted:
            self._listen()
            latest = self._children[0].latest
            if latest is not None and latest.dva is not None:
                return latest.dva
            if time.monotonic() > deadline:
                raise PartFailed(f"the DVA said nothing within {SPEAK_WITHIN:g} s")
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
        """Return True if a part has ended normally: its time is up, and so is that of the run."""
        return any(child.process.poll() == 0 for child in self._children)

    def _all_settled(self) -> bool:
        reports = [child.latest for child in self._children]
        if not all(report is not None and report.settled for report in reports):
            self._settled_since = None
            return False
        if self._settled_since is None:
            self._settled_since = time.monotonic()
        return time.monotonic() - self._settled_since > SETTLED_FOR

    def _listen(self) -> None:
        """Read what the parts say, for a moment at most.

        Raises:
            PartFailed: one of them is gone.
            LinkEnded: the emulated link is gone.
            DvaSimError: what one of them was given is not as it should be.
        """
        self._read(LOOK)
        self._tell_broken_rules()
        if self._link is not None and self._link.has_ended:
            raise self._link.ended()
        for child in self._children:
            code = child.process.poll()
            if code is not None and code != 0 and not self._interrupted:
                self._read(0.0)
                errors = child.errors.decode(errors="replace").strip().splitlines()
                why = errors[-1].removeprefix(ERROR) if errors else f"exit code {code}"
                kind = DvaSimError if code == ExitCode.MISTAKE else PartFailed
                raise kind(f"{child.name} has ended by itself: {why}")
            if code is None and time.monotonic() - child.heard > SPEAK_WITHIN:
                raise PartFailed(f"{child.name} has said nothing for {SPEAK_WITHIN:g} s")

    def _tell_broken_rules(self) -> None:
        """Report the rules that were found broken since the last look."""
        found = [list(moment) for moment in self._keeping.news()] if self._keeping else []
        if found:
            now = time.monotonic() - self._epoch
            self._hear(
                "rules",
                Report(
                    part="rules",
                    number=0,
                    time=now,
                    rows=[],
                    events=[],
                    story=found,
                    counters={},
                    settled=True,
                    dva=None,
                    lateness=0.0,
                ),
            )

    def _read(self, wait: float) -> None:
        for key, _ in self._selector.select(wait):
            child, take = key.data
            stream: IO[bytes] = key.fileobj  # type: ignore[assignment]
            data = stream.read(65_536)
            if data:
                take(child, data)
            elif data == b"":
                self._selector.unregister(stream)

    def _take_line(self, child: _Child, data: bytes) -> None:
        *lines, child.buffer = (child.buffer + data).split(b"\n")
        for line in lines:
            child.latest, child.heard = Report(**json.loads(line)), time.monotonic()
            self._hear(child.name, child.latest)

    @staticmethod
    def _take_error(child: _Child, data: bytes) -> None:
        child.errors = (child.errors + data)[-10_000:]

    def _end_all(self) -> None:
        """Ask all parts to end, operators first, and make sure that they have."""
        for child in reversed(self._children):
            if child.process.stdin is not None:
                with suppress(OSError):
                    child.process.stdin.close()
        deadline = time.monotonic() + END_WITHIN
        while any(c.process.poll() is None for c in self._children):
            if time.monotonic() > deadline:
                for child in self._children:
                    child.process.kill()
            self._read(0.05)
        self._read(0.0)
        for child in self._children:
            child.process.wait()
            for stream in (child.process.stdout, child.process.stderr):
                if stream is not None:
                    stream.close()
        self._selector.close()

    def _end_link(self) -> None:
        if self._link is not None:
            with suppress(LinkEnded):
                self._packets = self._link.report()
            self._link.close()


def _end_of(part: str) -> str:
    """The end of an emulated link that a part is at: its robots are at the far one."""
    return FAR if part == "world" else NEAR


def _ports(first: int, scenario: Scenario) -> Iterator[int]:
    """First ports of the world and of each operator, behind the DVA's two; 0 for free ones."""
    in_world = scenario.robot.count + scenario.guard.count + len(scenario.events)
    devices = 1
    while True:
        yield first + 2 * devices if first else 0
        devices += in_world if devices == 1 else 1
