"""Dishonest device: it forges, floods, replays, and drives besides the driver."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count

from dva_sim.agents.device import AgentDevice, do_nothing
from dva_sim.network.messaging import Wire
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode
from dva_sim.simulation.full.stage import DVA, Stage

NUMBER = 900  # number of the first intruder, beyond all operators of a scenario
BUSY_FOR = 2.0  # delay before a busy DVA is asked again [s]


class Intruder:
    """Device that sends anything to anybody.

    Args:
        number: Number among the intruders.
        label: Its name.
    """

    def __init__(self, stage: Stage, number: int = NUMBER, label: str = "intruder-1") -> None:
        self.device: AgentDevice = stage.device("operator", number)
        self.device.label = stage.labels[self.device.id_tag] = label
        self.device.serve(lambda message: m.Reply(message.message_id, m.OK, ""))
        self._network = stage.network
        self._tags = count(1)
        self._wires: dict[str, Wire] = {}
        self.ask = self.device.ask

    def send(self, to: str, data: bytes) -> None:
        """Send bytes as a request, and ignore the answer."""
        if to not in self._wires:
            node = self.device.id_tag
            self._wires[to] = self._network.connect(node, to, do_nothing, pipelined=True)
        self._wires[to].send(next(self._tags), data)

    def send_message(self, to: str, body: m.Body, session: int = 0) -> None:
        """Send a request, and ignore the answer."""
        now = self.device.clock.now
        self.send(to, encode(self.device.outbox.message(to, body, now, session)))

    def report(self, kind: str, place: m.Position) -> None:
        """Report an event once."""
        self.ask(DVA, m.EventReport(None, kind, place, 0.5, 0.9, "detected"))

    def drive(self, robot: str, rate: float) -> Callable[[], None]:
        """Request a robot until it is granted, then drive it at a rate of commands [Hz].

        Returns:
            Function that ends the drive: the device vanishes without giving anything back.
        """
        sessions = list[int]()
        goes = [True]
        self.device.register()

        def answered(reply: m.Reply) -> None:
            if isinstance(reply.content, m.Permission):
                sessions[:] = [reply.content.session]
                self.ask(robot, m.StartTeleOp(), session=sessions[0])

        def act() -> bool:
            if not sessions:
                self.ask(DVA, m.PermissionRequest(robot, "teleoperation"), answered)
            return goes[0]

        def command() -> bool:
            if sessions and goes[0]:
                self.send_message(robot, m.SetTeleOp(0.4, 0.2), sessions[0])
            return goes[0]

        def ends() -> None:
            goes[0] = False
            self.device.leave()
            self.device.come_back()

        self.device.clock.every(2.0, act)
        self.device.clock.every(1.0 / rate, command)
        return ends


def give_back(device: AgentDevice, held: m.PermissionRevocation, after: float = 0.0) -> None:
    """Let a device give a permission back after a time [s], until the DVA has saved that."""

    def answered(reply: m.Reply) -> None:
        if reply.code == m.BUSY:
            device.clock.call_after(BUSY_FOR, again)

    def again() -> None:
        device.clock.call_after(after, device.ask, DVA, held, answered, again)

    again()
