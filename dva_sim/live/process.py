"""One process of a live run: its part, its sockets, its clock, and how it ends."""

from __future__ import annotations

import gc
import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

from dva_sim.agents.observation import OVER_ZMQ, Cameras, topic_in
from dva_sim.cameras.screens import topic_of
from dva_sim.cameras.service import CameraService
from dva_sim.kernel.errors import DvaSimError, RunsFailed
from dva_sim.live.options import CAMERA_PORT, addresses_of, scenario_of
from dva_sim.live.parts import DvaPart, LivePart, WorldPart, make_part
from dva_sim.live.recording import LiveRecorder, RunKeeping
from dva_sim.network.keys import KeyRing
from dva_sim.network.real_network import RealNetwork
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork, split_address
from dva_sim.options.runs import LiveOptions
from dva_sim.protocol.devices import ControlRoomRole
from dva_sim.serving.open_port import OpenPort
from dva_sim.serving.pipes import PipeEnd
from dva_sim.serving.signals import caught_signals
from dva_sim.simulation.full.dva_server import DvaAgent
from dva_sim.simulation.full.stage import DVA, Stage, dvas_of, id_of, team_of
from dva_sim.simulation.full.verdicts import Verdict

REPORT_PERIOD = 1.0  # interval between two reports [s]
LAST_WORDS = 0.5  # time for last messages before the sockets are closed [s]
DVA_WAIT_S = 30.0  # longest wait of a lone part for a DVA that does not answer [s]


@dataclass(frozen=True)
class ServedDva:
    """A DVA of this process, for the programs beside it.

    Attributes:
        agent: The DVA.
        network: Network of the DVA.
        aside: Devices that do not count as its company; see `DvaPart`.
        tell: Function that adds a line to the timeline.
    """

    agent: DvaAgent
    network: SocketNetwork
    aside: set[str]
    tell: Callable[[str], object]

    @property
    def address(self) -> str:
        """Address that the DVA listens on."""
        return str(self.network.address(self.agent.device.id_tag))

    def appoint(self, room: str, role: ControlRoomRole) -> None:
        """Give the control room beside the DVA a role."""
        self.aside.add(room)
        self.agent.core.roles.appoint(room, role)


class Beside(Protocol):
    """Program that runs beside a DVA."""

    def begin(self, dva: ServedDva) -> None:
        """Begin once the DVA listens."""

    def end(self) -> None:
        """End."""


class NobodyThere(RunsFailed):
    """Lack of any answer from the devices that a part depends on."""


@dataclass
class Report:
    """Report of a part, sent once a second as a line of JSON.

    Attributes:
        part: `dva`, `world` or `operator`.
        number: Number of the operator.
        time: Time since the start of the run [s].
        rows: See `LivePart.rows`.
        events: Events; only from the DVA.
        story: New lines of the timeline: time [s], who, what, kind.
        counters: Messages refused or dropped so far, by reason.
        settled: See `LivePart.settled`.
        dva: Address of the DVA; only from the DVA.
        lateness: Longest wait of an event for the processor [s].
    """

    part: str
    number: int
    time: float
    rows: list[dict[str, Any]]
    events: list[dict[str, Any]]
    story: list[list[Any]]
    counters: dict[str, int]
    settled: bool
    dva: str | None
    lateness: float


def run_part(
    name: str,
    options: LiveOptions,
    say: Callable[[Report], object],
    number: int = 1,
    epoch: float | None = None,
    supervised: bool = False,
    outlet: int | None = None,
    door: OpenPort | None = None,
    beside: Beside | None = None,
) -> list[Verdict]:
    """Run a part until the end of the run, Ctrl-C, SIGTERM, SIGHUP, or the end of standard input.

    A part without a supervisor gives up if nobody answers for `DVA_WAIT_S`. A DVA without a
    supervisor serves until it is ended, or for the time in the options.

    Args:
        name: `dva`, `world` or `operator`.
        options: Scenario, addresses and other options.
        say: Callback for a report as soon as the part listens, each second, and one at the end.
            It returns False if there was no room for the report.
        number: Number of the operator.
        epoch: Start of the run by `time.monotonic`, which all processes of a machine share [s].
        supervised: True to end at the end of standard input, when the parent process has ended.
        outlet: File descriptor for lines that are recorded and judged elsewhere. None: this part
            records and judges them itself.
        door: Port for clients of other makers, if this part serves them.
        beside: Program that runs beside a DVA, such as its page.

    Returns:
        Verdicts on the safety rules from the facts of this part; none with an outlet.

    Raises:
        ConfigError: scenario, keys or part are invalid.
        DvaSimError: the recording is missing or incomplete.
        NetworkError: a port is taken.
        NobodyThere: no other part answered.
    """
    alone = RunKeeping(options, scenario_of(options)) if outlet is None else None
    out = PipeEnd(alone.inlet() if alone is not None else outlet or 0)
    try:
        _run_part(
            name=name,
            options=options,
            say=say,
            number=number,
            epoch=epoch,
            supervised=supervised,
            out=out,
            door=door,
            beside=beside,
        )
    finally:
        out.close()
        lost = None if alone is None else alone.finish()
    if lost is not None:
        raise DvaSimError(lost)
    return [] if alone is None else alone.verdicts()


def _run_part(
    name: str,
    options: LiveOptions,
    say: Callable[[Report], object],
    number: int,
    epoch: float | None,
    supervised: bool,
    out: PipeEnd,
    door: OpenPort | None,
    beside: Beside | None,
) -> None:
    scenario = scenario_of(options)
    ring = None if options.keys is None else KeyRing(options.keys)
    clock = LiveClock(epoch)
    recorder = LiveRecorder(clock, out, keeps=options.records_run or options.shows_run)

    def tell(line: str) -> None:
        recorder.tell(clock.now, name, line, "link")

    with ExitStack() as at_end:
        network = SocketNetwork(clock, ring, tell, scenario.zeromq)
        at_end.callback(network.close)
        team = frozenset(team_of(scenario))
        recorder.team = team
        recorder.is_own = team.__contains__ if supervised else network.is_here
        network.watcher = recorder.message
        joining = _joining(network, options, name, number)
        service = None
        if name == "world" and options.shows_pictures:
            port = CAMERA_PORT if options.camera_port is None else options.camera_port
            service = CameraService(options.host, port, clock, tell)
            at_end.callback(service.close)
        url = OVER_ZMQ.url if service is None else service.url
        cameras = Cameras(url, lambda url: topic_in(url) or topic_of(url))
        stage = Stage(
            scenario,
            seed=options.seed,
            network=network,
            recorder=recorder,
            address=joining,
            time_of_day=_time_of_day(clock),
            cameras=cameras,
            attended=True,
        )
        own_id = id_of("dva", number) if name == "dva" else ""
        for dva, address in zip(dvas_of(scenario), addresses_of(options), strict=False):
            if dva != own_id:
                network.introduce(dva, address)
        part = make_part(name, stage, options, number, door)
        if options.dva is not None and not (stage.regions is not None and name == "dva"):
            for device in stage.devices:
                device.look_for_dva_at(options.dva)
        recorder.here(d.id_tag for d in stage.devices if recorder.is_own(d.id_tag))
        if service is not None and isinstance(part, WorldPart):
            part.film(service)
        if beside is not None and isinstance(part, DvaPart) and stage.regions is None:
            at_end.callback(beside.end)
            beside.begin(ServedDva(part.agent, network, part.aside, tell))
        gc.freeze()  # objects that last for the whole run need no collection
        reporter = _Reporter(name, number, stage, part, network)
        clock.every(REPORT_PERIOD, lambda: reporter.tell(say))
        serves = name == "dva" and not supervised
        default_duration = math.inf if serves else scenario.horizon_s
        lasts = default_duration if options.duration is None else options.duration
        patience = lasts if serves else min(DVA_WAIT_S, lasts)
        with ending_when_asked(clock, supervised) as ending:
            if not supervised:
                clock.run(patience)
                own = network.address(own_id or DVA)
                _refuse_to_be_alone(name, part, own, patience, ending)
            if not ending.is_asked:
                clock.run(lasts)
            part.finish()
            clock.run(clock.now + LAST_WORDS)
        reporter.tell(say)


def _refuse_to_be_alone(
    name: str, part: LivePart, dva: str | None, waited: float, ending: EndRequest
) -> None:
    if ending.is_asked or part.has_company():
        return
    if name == "dva":
        raise NobodyThere(f"no device joined the DVA at {dva} within {waited:g} s")
    raise NobodyThere(
        f"no DVA answered at {dva} within {waited:g} s; start it there with --only dva, or say "
        "with --dva where it is"
    )


def _time_of_day(clock: LiveClock) -> tuple[float, bool]:
    """Return the start of the run by the wall clock [s since midnight]; and whether it is exact."""
    started = time.time() - clock.now
    local = time.localtime(started)
    seconds = local.tm_hour * 3600 + local.tm_min * 60 + local.tm_sec
    return seconds + started % 1.0, True


def _joining(
    network: RealNetwork, options: LiveOptions, name: str, of: int
) -> Callable[[str, int], str]:
    """Return a function that assigns two ports to each new device, and returns its address."""
    next_port = options.port

    def join(kind: str, number: int) -> str:
        nonlocal next_port
        host = options.host
        port = next_port
        if name == "dva" and options.dva is not None:
            host, port = split_address(addresses_of(options)[of - 1])
        elif next_port:
            next_port += 2
        return network.join(id_of(kind, number), host, port)

    return join


class _Reporter:
    """Collects the reports of a part; each line of the story is reported once."""

    def __init__(
        self, name: str, number: int, stage: Stage, part: LivePart, network: RealNetwork
    ) -> None:
        self._name = name
        self._number = number
        self._stage = stage
        self._part = part
        self._network = network

    def tell(self, say: Callable[[Report], object]) -> None:
        """Report the present, and what of the story has not been taken before."""
        recorder = self._stage.recorder
        part = self._part
        if isinstance(recorder, LiveRecorder):
            part.keep(recorder)
            recorder.is_alive()
        story = recorder.timeline
        recorder.timeline = []
        clock = self._network.clock
        report = Report(
            part=self._name,
            number=self._number,
            time=clock.now,
            rows=part.rows(),
            events=part.events() if isinstance(part, DvaPart) else [],
            story=[list(moment) for moment in story],
            counters=dict(recorder.counters + self._network.counters),
            settled=part.settled(),
            dva=self._network.address(id_of("dva", self._number)) if self._name == "dva" else None,
            lateness=clock.lateness,
        )
        if say(report) is False:
            recorder.timeline[:0] = story


@dataclass
class EndRequest:
    """A request for the end of a program.

    Attributes:
        is_asked: True once a signal, or the end of standard input, has asked for it.
    """

    is_asked: bool = False


@contextmanager
def ending_when_asked(clock: LiveClock, supervised: bool) -> Iterator[EndRequest]:
    """Stop the clock on SIGINT, SIGTERM, SIGHUP, or the end of standard input.

    Args:
        clock: Clock of the run.
        supervised: True to end at the end of standard input.
    """
    ending = EndRequest()

    def stop() -> None:
        ending.is_asked = True
        unwatch()
        clock.stop()

    def unwatch() -> None:
        for number in watched:
            clock.unwatch(number)

    with caught_signals() as signals:
        watched = [signals.fileno(), *([sys.stdin.fileno()] if supervised else [])]
        for number in watched:
            clock.watch(number, stop)
        try:
            yield ending
        finally:
            unwatch()
