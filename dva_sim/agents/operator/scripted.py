"""Scripted operators: the next request depends on the replies, never on time.

A script is a generator that yields requests and receives the replies, or None after a time-out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import NamedTuple

from dva_sim.agents.device import STATUS, AgentDevice
from dva_sim.agents.operator.refusals import Refusals
from dva_sim.protocol import messages as m


class Ask(NamedTuple):
    """A request: to which device, what, in which session."""

    to: str
    body: m.Body
    session: int = 0


class Pause(NamedTuple):
    """Pause without requests [s]."""

    seconds: float


Script = Generator[Ask | Pause, m.Reply | None, None]


class ScriptedOperator:
    """Registers, then does what a script says.

    Args:
        device: Identity and connections of the operator.
        script: Function that makes the script for the operator, which it may ask for `seen_tick`.

    Attributes:
        transcript: Requests and replies: the name of the message, and the reply code; -1 without a
            reply.
        done: True once the script has ended.
        asked: Number of requests made.
    """

    def __init__(self, device: AgentDevice, script: Callable[[ScriptedOperator], Script]) -> None:
        self.device = device
        self.transcript: list[tuple[str, int]] = []
        self.done = False
        self.asked = 0
        self.seen_tick: int | None = None
        self._script = script(self)
        device.serve(self._on_request)

    @property
    def activity(self) -> str:
        """Activity, in words."""
        return "done" if self.done else "follows a script"

    def start(self) -> None:
        """Register, and begin."""
        self.device.register(lambda: self._go_on(None))

    def watch_status(self, robot: str) -> None:
        """Read the ticks of a robot, to echo them in commands."""
        network = self.device.network
        me = self.device.id_tag
        network.subscribe(me, robot, STATUS, lambda data: self._on_status(robot, data))

    def tell(self, what: str) -> None:
        """Report a request and its outcome."""
        self.device.tell(what, "drive")

    def put_down(self) -> None:
        """End the script; its final requests are sent without waiting for replies."""
        if not self.done:
            self.done = True
            self._script.close()

    def _on_status(self, robot: str, data: bytes) -> None:
        message = self.device.read(data, robot)
        if message is not None and isinstance(message.body, m.RobotStatus):
            self.seen_tick = message.body.tick

    def _on_request(self, message: m.Message) -> m.Reply:
        if isinstance(message.body, m.PermissionRevocation):
            return m.Reply(message.message_id, m.OK, "")
        if isinstance(message.body, m.Order):
            self.tell(f"declines event {message.body.event_id}: it follows a script")
        return m.Reply(message.message_id, m.NOT_SUPPORTED, "follows a script")

    def _go_on(self, reply: m.Reply | None) -> None:
        if self.done:
            return
        try:
            step = self._script.send(reply)
        except StopIteration:
            self.done = True
            return
        if isinstance(step, Pause):
            self.device.clock.call_after(step.seconds, self._go_on, None)
            return
        self.asked += 1
        name = type(step.body).__name__
        self.device.ask(
            step.to,
            step.body,
            lambda answer: self._note(name, answer),
            lambda: self._note(name, None),
            step.session,
        )

    def _note(self, name: str, reply: m.Reply | None) -> None:
        self.transcript.append((name, -1 if reply is None else reply.code))
        self._go_on(reply)


def drill(operator: ScriptedOperator, commands: int = 200) -> Script:
    """Return a whole session: find a robot, drive, emergency stop, refusal, drive again.

    Args:
        operator: Operator that follows the script.
        commands: Number of commands in the first drive.
    """
    dva = operator.device.dva
    robot, session = yield from _take_a_robot(dva)
    name = operator.device.label_of(robot)
    operator.watch_status(robot)
    try:
        if (yield from _drive(operator, robot, session, commands)):
            reply = yield Ask(robot, m.Emergency(), session)
            operator.tell(f"sends {name} an emergency: {_answer(reply)}")
            reply = yield Ask(robot, _swaying(0, operator.seen_tick), session)
            operator.tell(f"sends {name} one more command: {_answer(reply)}")  # the robot is idle
            yield Pause(STANDSTILL)
            yield from _drive(operator, robot, session, COMMANDS_AGAIN)
        reply = yield Ask(robot, m.StopTeleOp(), session)
        operator.tell(f"stops {name}: {_answer(reply)}")
    except GeneratorExit:
        operator.device.ask(robot, m.StopTeleOp(), session=session)
        raise
    given_back = Ask(dva, m.PermissionRevocation(robot, operator.device.id_tag, session))
    while (reply := (yield given_back)) is not None and reply.code == m.BUSY:
        yield Pause(GIVE_BACK_AGAIN)


def _drive(
    operator: ScriptedOperator, robot: str, session: int, commands: int
) -> Generator[Ask | Pause, m.Reply | None, bool]:
    """Start the robot, and send `commands` commands.

    False if the robot cannot be started, or obeys no more.
    """
    name = operator.device.label_of(robot)
    if not (yield from _start(robot, session)):
        operator.tell(f"cannot start {name}")
        return False
    operator.tell(f"starts {name} and sends {commands} commands")
    obeyed = 0
    refusals = Refusals(operator.device.id_tag)
    for number in range(commands):
        reply = yield Ask(robot, _swaying(number, operator.seen_tick), session)
        code = None if reply is None else reply.code
        why = refusals.answered(code, operator.device.clock.now)
        obeyed += reply is not None and reply.code == m.OK
        if why:
            operator.tell(f"stops driving {name} after {obeyed} of {commands} commands: {why}")
            return False
    operator.tell(f"has driven {name}: {obeyed} of {commands} commands obeyed")
    return True


def _answer(reply: m.Reply | None) -> str:
    """Describe a robot's answer to a request."""
    if reply is None:
        return "no answer"
    return "obeyed" if reply.code == m.OK else f"refused ({m.CODE_NAMES[reply.code]})"


COMMANDS_AGAIN = 10  # design: number of commands in the second drive
GIVE_BACK_AGAIN = 2.0  # design: while the DVA cannot keep that [s]
STANDSTILL = 2.0  # design: time after which a stopped robot stands [s]
TRIES = 20  # design: maximum attempts to start a drive
RETRY_DELAY_S = 0.5  # design: pause before a request for something missing is repeated [s]


def _take_a_robot(dva: str) -> Generator[Ask | Pause, m.Reply | None, tuple[str, int]]:
    """Wait until a robot is free; return its id and the session."""
    while True:
        listed = yield Ask(dva, m.GetDeviceList())
        content = None if listed is None else listed.content
        devices = content.devices if isinstance(content, m.DeviceList) else ()
        for robot in (d.id_tag for d in devices if d.device_type == "Robot"):
            reply = yield Ask(dva, m.PermissionRequest(robot, "teleoperation"))
            if reply is not None and isinstance(reply.content, m.Permission):
                return robot, reply.content.session
        yield Pause(RETRY_DELAY_S)


def _start(robot: str, session: int) -> Generator[Ask | Pause, m.Reply | None, bool]:
    """Start; the grant may reach the robot a little later than the permission reached us."""
    for _ in range(TRIES):
        yield Pause(RETRY_DELAY_S)
        reply = yield Ask(robot, m.StartTeleOp(), session)
        if reply is not None and reply.code == m.OK:
            return True
    return False


def _swaying(number: int, seen_tick: int | None) -> m.SetTeleOp:
    """Return a command slowly forward, to the left and to the right by turns."""
    return m.SetTeleOp(0.1, 0.3 * math.sin(number / 10.0), seen_tick)
