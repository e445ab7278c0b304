"""Devices that put load on a DVA, in a process of their own: `python -m ... JSON`.

They register, send heartbeats, publish, report and obey by the same client as simulated robots and
guards, but have no body: they only answer messages.
"""

from __future__ import annotations

import json
import sys
import time
from collections import Counter, defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from random import Random
from typing import Any, Final

from dva_sim.agents.device import STATUS, AgentDevice
from dva_sim.kernel.errors import DvaSimError, error_line
from dva_sim.kernel.recorder import Recorder
from dva_sim.live.open_files import check_room_for
from dva_sim.live.process import ending_when_asked
from dva_sim.network.addresses import address_towards
from dva_sim.network.keys import KeyRing
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import GUARD, ROBOT
from dva_sim.simulation.full.stage import DVA, TYPES, id_of, label_of
from dva_sim.worlds.site import DEFAULT_FRAME

GUARDS: Final = 0.2  # design: share of guards among the devices
TIMEOUT: Final = 2.0  # design: time without a reply after which a request is lost [s]
PLACES: Final = tuple(
    (2.0 + 4.0 * n, 12.0) for n in range(10)
)  # design: places of events, in a corridor [m]
FIRST: Final = 1001  # design: number of the first device; scenarios use lower ones
PROCESS_STRIDE: Final = 4096  # design: distance between the device numbers of two processes
LONGEST: Final = 36_000.0  # design: maximum run time, in case the parent is killed [s]


@dataclass(frozen=True, kw_only=True)
class LoadShare:
    """Share of a load that one process makes.

    Attributes:
        dva: Address of the DVA.
        host: Address that the devices listen on; empty: one that the DVA can reach.
        number: Number of the process, from 0.
        devices: Number of devices, including those in sessions and the detector that reports.
        sessions: Number of operators, each of whom drives a robot.
        status_hz: Rate of status messages of each device [1/s].
        command_hz: Rate of commands of each operator [1/s].
        reports_hz: Rate of events that the process reports [1/s].
        churn_hz: Rate of devices that restart [1/s].
        duration: Duration of the measurement [s].
        settle: Time for all devices to join before the measurement [s].
        seed: Random seed for positions and the choice of devices that restart.
        keys: Folder of their keys; None: not encrypted.
    """

    dva: str
    host: str
    number: int
    devices: int
    sessions: int
    status_hz: float
    command_hz: float
    reports_hz: float
    churn_hz: float
    duration: float
    settle: float
    seed: int
    keys: str | None = None

    def numbers(self) -> dict[str, range]:
        """Return the numbers of the devices, by kind."""
        guards = int(GUARDS * (self.devices - 2 * self.sessions - 1))
        counts = {
            "detector": 1,
            "guard": guards,
            "robot": self.devices - self.sessions - guards - 1,
            "operator": self.sessions,
        }
        first = FIRST + PROCESS_STRIDE * self.number
        return {kind: range(first, first + count) for kind, count in counts.items()}


@dataclass
class LoadCounts:
    """Counts of one process, as it sends them to its parent.

    Attributes:
        trips: Time from each request to its reply [s], by kind of request.
        refused: Refusals by kind and code.
        lost: Requests without a reply, by kind.
        published: Number of published messages.
        reported: Place and time of each reported event, by the machine's clock [s].
        ordered: Place and time of each order, by the same clock [s].
        joined: Number of devices that are registered at the end.
        late: Longest delay of an action by this process [s].
    """

    trips: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    refused: Counter[str] = field(default_factory=Counter)
    lost: Counter[str] = field(default_factory=Counter)
    published: int = 0
    reported: list[tuple[str, float]] = field(default_factory=list)
    ordered: list[tuple[str, float]] = field(default_factory=list)
    joined: int = 0
    late: float = 0.0


def place_of(position: m.Position) -> str:
    """Return a key for a position that is equal in an event's report and order."""
    return f"{position.latitude:.5f},{position.longitude:.5f}"


class LoadDevices:
    """The devices of one process.

    Args:
        network: Sockets of the devices.
        share: Share of the load that they make.
    """

    def __init__(self, network: SocketNetwork, share: LoadShare) -> None:
        self._network = network
        self._share = share
        self._rng = Random(f"{share.seed}/{share.number}")
        self._joined: set[str] = set()
        self._commanded: set[str] = set()
        self._vanished: deque[AgentDevice] = deque()
        self.counts = LoadCounts()
        network.introduce(DVA, share.dva)
        everybody = {
            kind: [self._device(kind, number) for number in numbers]
            for kind, numbers in share.numbers().items()
        }
        (self._detector,) = everybody["detector"]
        self._guards = everybody["guard"]
        self._robots = everybody["robot"]
        self._operators = everybody["operator"]

    def begin(self) -> None:
        """Let all devices join, spread over the first half of the settling time, and work."""
        clock = self._network.clock
        share = self._share
        everybody = [self._detector, *self._robots, *self._guards, *self._operators]
        for number, device in enumerate(everybody):
            device.serve(partial(self._obey, device))
            clock.call_after(share.settle / 2 * number / len(everybody), self._join, device)
        clock.call_after(share.settle, self._measure)
        for operator, robot in zip(self._operators, self._robots, strict=False):
            clock.call_after(0.7 * share.settle, self._request_session, operator, robot)
        if share.reports_hz:
            clock.every(1 / share.reports_hz, self._report, clock.now + share.settle)
        if share.churn_hz:
            clock.every(1 / share.churn_hz, self._churn, clock.now + share.settle)

    def finish(self) -> LoadCounts:
        """Return the counts."""
        self.counts.joined = len(self._joined)
        self.counts.late = self._network.clock.lateness
        return self.counts

    def _device(self, kind: str, number: int) -> AgentDevice:
        id_tag = id_of(kind, number)
        return AgentDevice(
            id_tag=id_tag,
            label=label_of(kind, number),
            device_type=TYPES[kind],
            address=self._network.join(id_tag, self._share.host),
            dva=DVA,
            network=self._network,
            recorder=Recorder(),
            frame=DEFAULT_FRAME,
            timeout=TIMEOUT,
            attempts=1,
        )

    def _measure(self) -> None:
        self.counts = LoadCounts()
        self._network.clock.lateness = 0.0

    def _join(self, device: AgentDevice) -> None:
        device.register(partial(self._joined.add, device.id_tag))
        if device.device_type in (ROBOT, GUARD):
            self._network.clock.every(1 / self._share.status_hz, partial(self._status, device))

    def _status(self, device: AgentDevice) -> None:
        if device.id_tag not in self._joined or device.silent:
            return
        now = self._network.clock.now
        at = self._somewhere()
        robot = m.RobotStatus("Idle", at, 0.0, 0.0, 0.0, int(1000 * now))
        is_robot = device.device_type == ROBOT
        device.publish(STATUS, robot if is_robot else m.PersonStatus("waiting", at))
        self.counts.published += 1

    def _somewhere(self) -> m.Position:
        return m.Position(*DEFAULT_FRAME.to_latlon(*self._rng.choice(PLACES)))

    def _timed(
        self,
        kind: str,
        device: AgentDevice,
        peer: str,
        body: m.Body,
        then: Callable[[m.Reply], object] = lambda _: None,
        session: int = 0,
    ) -> None:
        """Send a request, and count its outcome."""
        clock = self._network.clock
        sent_at = clock.now

        def answered(reply: m.Reply) -> None:
            if reply.code != m.OK:
                self.counts.refused[f"{kind}: {m.CODE_NAMES[reply.code]}"] += 1
            self.counts.trips[kind].append(clock.now - sent_at)
            then(reply)

        device.ask(peer, body, answered, lambda: self.counts.lost.update([kind]), session)

    def _request_session(self, operator: AgentDevice, robot: AgentDevice) -> None:
        def granted(reply: m.Reply) -> None:
            if isinstance(reply.content, m.Permission) and operator.id_tag not in self._commanded:
                self._commanded.add(operator.id_tag)
                period = 1 / self._share.command_hz
                drive = partial(self._command, operator, robot, reply.content.session)
                self._network.clock.every(period, drive)
                self._network.clock.every(1.0, partial(self._look_and_stop, operator, robot))

        wish = m.PermissionRequest(robot.id_tag, "teleoperation")
        self._timed("session", operator, DVA, wish, granted)

    def _command(self, operator: AgentDevice, robot: AgentDevice, session: int) -> None:
        command = m.SetTeleOp(self._rng.uniform(0.0, 0.4), 0.0)
        self._timed("command", operator, robot.id_tag, command, session=session)

    def _look_and_stop(self, operator: AgentDevice, robot: AgentDevice) -> None:
        self._timed("list", operator, DVA, m.GetDeviceList())
        self._timed("emergency", operator, robot.id_tag, m.Emergency())

    def _report(self) -> None:
        at = self._somewhere()
        self.counts.reported.append((place_of(at), time.monotonic()))
        report = m.EventReport(None, "fire", at, 0.5, 0.9, "detected")
        self._timed("report", self._detector, DVA, report)

    def _churn(self) -> None:
        """Let one device vanish, and restart the one that vanished before."""
        idle = self._robots[self._share.sessions :]
        if self._vanished:
            device = self._vanished.popleft()
            device.restart()
            device.register(partial(self._joined.add, device.id_tag))
        elif idle:
            device = self._rng.choice(idle)
            self._vanished.append(device)
            device.crash()

    def _obey(self, device: AgentDevice, message: m.Message) -> m.Reply:
        """Answer a request; report an empty finding for an order to look."""
        match message.body:
            case m.Order() as order:
                self.counts.ordered.append((place_of(order.position), time.monotonic()))
                refuted = m.EventReport(
                    order.event_id, order.kind, order.position, 0.0, 0.9, "refuted"
                )
                for state in ("departed", "arrived"):
                    device.progress(order.event_id, state)
                self._timed("report", device, DVA, refuted)
        return m.Reply(message.message_id, m.OK, "")


def make(share: LoadShare, supervised: bool = False) -> dict[str, Any]:
    """Run one share of a load for its duration; return its counts, as `LoadCounts`.

    Args:
        share: The share; without a host, its devices listen where the DVA can reach this
            machine.
        supervised: True to end at the end of standard input.

    Raises:
        DvaSimError: there are too few open files, or an address is not free.
    """
    check_room_for(share.devices + share.sessions)  # each with a driver of its own
    network = SocketNetwork(LiveClock(), KeyRing(share.keys) if share.keys else None)
    try:
        devices = LoadDevices(
            network, replace(share, host=share.host or address_towards(share.dva))
        )
        devices.begin()
        with ending_when_asked(network.clock, supervised):
            network.clock.run(min(LONGEST, share.settle + share.duration))
        return vars(devices.finish())
    finally:
        network.close()


def main(argument: str) -> int:
    """Run one share of a load; print its counts to standard output."""
    try:
        json.dump(make(LoadShare(**json.loads(argument)), supervised=True), sys.stdout)
    except DvaSimError as error:
        print(error_line(error), file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
