"""One session of one robot and one scripted operator, in virtual time or over sockets."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple

from helpers.processes.patience import Patient

from dva_sim.agents.device import command_topic
from dva_sim.agents.operator.scripted import Ask, Pause, Script, ScriptedOperator, drill
from dva_sim.agents.robot.controller import Decision, RobotController
from dva_sim.agents.robot.decision_log import ASKS, DecisionLog
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import Recorder
from dva_sim.kernel.streams import Streams
from dva_sim.network.link import ConstantRate, Link, LinkConfig
from dva_sim.network.messaging import Requester, Transport
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.protocol import messages as m
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.control_room import add_dva
from dva_sim.simulation.full.physical_world import Field
from dva_sim.simulation.full.stage import Stage, id_of

ROBOT, OPERATOR = id_of("robot", 1), id_of("operator", 1)
STEP = 0.02  # interval of checks for the end [s]

# Far above any gap between commands, so that nothing hangs on how fast a clock goes.
PATIENT = {
    "robot.watchdog_s": 60,
    "robot.max_age_s": 120,
    "robot.processing_s": 0,
    "command.timeout_s": 120,
}
SILENT_AFTER = 600.0  # the same for the DVA [s]


class Decided(NamedTuple):
    """Decision of a robot on a message; a set point's time is left out, as clocks differ."""

    message: str
    code: int
    text: str
    mode: str
    speed: float | None
    turn_rate: float | None


@dataclass
class Witness:
    """In the place of a robot's trace, or before it: notes each decision."""

    controller: RobotController
    trace: DecisionLog | None = None
    decisions: list[Decided] = field(default_factory=list)

    def decided(
        self,
        message: m.Message,
        arrived: float,
        now: float,
        moving: bool,
        decision: Decision,
        waited: bool = False,
    ) -> None:
        if self.trace is not None:
            self.trace.decided(message, arrived, now, moving, decision, waited)
        if isinstance(message.body, m.Reply) or (decision.waits and not waited):
            return  # what the DVA confirms, and what waits for that, takes its time
        kind, mode = type(message.body).__name__, self.controller.mode.value
        speed, turn_rate, _ = decision.set_point or (None, None, None)
        self.decisions.append(Decided(kind, decision.code, decision.text, mode, speed, turn_rate))

    def happened(self, what: str, now: float) -> None:
        if what != ASKS:
            self.decisions.append(Decided(what, 0, "", self.controller.mode.value, None, None))
        if self.trace is not None:
            self.trace.happened(what, now)

    def count(self, kind: str) -> int:
        return sum(d.message == kind for d in self.decisions)


Way = Callable[[ScriptedOperator, Witness], Script]


def one_by_one(operator: ScriptedOperator, _: Witness) -> Script:
    """Perform the drill: each command waits for the reply to the last one."""
    return drill(operator)


STRANGER = id_of("operator", 9)


def forged(operator: ScriptedOperator, _: Witness) -> Script:
    """The drill, but somebody has told the robot in the DVA's name that another holds it."""
    device, steps, reply = operator.device, drill(operator), None
    reported = False
    while (step := _next(steps, reply)) is not None:
        if isinstance(step, Ask) and isinstance(step.body, m.StartTeleOp) and not reported:
            reported, me = True, device.outbox.source
            device.outbox.source = device.dva
            yield Ask(step.to, m.PermissionGrant(STRANGER, "both", step.session + (9 << 32)))
            device.outbox.source = me
        reply = yield step


def pipelined(operator: ScriptedOperator, _: Witness) -> Script:
    """The drill with eight commands under way at once; anything else waits for their replies."""
    device, steps, reply = operator.device, drill(operator), None
    requester = Requester(device.network, OPERATOR, ROBOT, timeout=120.0, window=8)
    asked, answered = 0, list[bytes]()
    while (step := _next(steps, reply)) is not None:
        if isinstance(step, Ask) and isinstance(step.body, m.SetTeleOp):
            data = device.outbox.encode(ROBOT, step.body, device.clock.now, step.session)
            requester.request(data, answered.append)
            asked += 1
            continue
        while len(answered) < asked:
            yield Pause(STEP)
        reply = yield step


def published(operator: ScriptedOperator, witness: Witness) -> Script:
    """Perform the drill with published commands: each waits until the robot has the last one.

    A robot that is not driven hears no commands, so the one after the emergency goes nowhere.
    """
    device, steps, reply = operator.device, drill(operator), None
    wanted = partial(device.network.ready, OPERATOR, command_topic(ROBOT), 1)
    driving, sent = False, 0
    while (step := _next(steps, reply)) is not None:
        if isinstance(step, Ask) and isinstance(step.body, m.SetTeleOp):
            if not driving:
                continue
            data = device.outbox.encode(ROBOT, step.body, device.clock.now, step.session)
            device.network.publish(OPERATOR, command_topic(ROBOT), data, len(data))
            sent += 1
            while witness.count("SetTeleOp") < sent:
                yield Pause(STEP / 10)
            continue
        reply = yield step
        if isinstance(step, Ask) and isinstance(step.body, m.StartTeleOp | m.Emergency):
            driving = isinstance(step.body, m.StartTeleOp) and reply.code == m.OK
            while wanted() is not driving:  # a subscription takes a moment to come or to go
                yield Pause(STEP)


def _next(steps: Script, reply: m.Reply | None) -> Ask | Pause | None:
    try:
        return steps.send(reply)
    except StopIteration:
        return None


def in_virtual_time(way: Way = one_by_one, **changes: object) -> list[Decided]:
    """Decisions of the robot in a session in virtual time."""
    return _act_out(_stage(_quick_network(), changes), way)


def story_in_virtual_time(**changes: object) -> list[str]:
    """Timeline of the operator in such a session."""
    stage = _stage(_quick_network(), changes)
    _act_out(stage, one_by_one)
    return [moment.what for moment in stage.recorder.timeline if moment.who == "operator-1"]


def _quick_network() -> VirtualNetwork:
    """A network of a millisecond each way."""
    config = LinkConfig(delay_s=0.001)
    there, back = (
        Link(config, ConstantRate(config.rate_bps), Streams(1), name) for name in ("there", "back")
    )
    return VirtualNetwork(Clock(), lambda *_: (there, back))


def over_sockets(
    way: Way = one_by_one, trace: Path | None = None, **changes: object
) -> list[Decided]:
    """Decisions of the robot in a session of some seconds, optionally traced."""
    network = SocketNetwork(LiveClock())
    join = lambda kind, number: network.join(id_of(kind, number))  # noqa: E731
    try:
        return _act_out(_stage(network, changes, address=join), way, trace)
    finally:
        network.close()


def _stage(network: Transport, changes: dict[str, object], **address: object) -> Stage:
    scenario = scenarios.build(scenarios.load("drive-to-event"), PATIENT | changes)
    return Stage(scenario, 1, network, Recorder(), **address)  # type: ignore[arg-type]


class Scene(Patient):
    """The DVA, a robot in a building, its decisions, and added devices."""

    step_s = STEP

    def __init__(self, stage: Stage, trace: Path | None = None) -> None:
        self.stage, self.clock, self.dva = stage, stage.clock, add_dva(stage)
        self.dva.core.registry.silent_after = SILENT_AFTER
        self.field = Field(stage)
        self.field.populate()
        self.robot = self.field.robots[ROBOT]
        controller = self.robot.controller
        self.witness = Witness(controller, trace and DecisionLog(trace, controller))
        self.robot.trace = self.witness  # type: ignore[assignment]
        self.dva.start()

    def enters(
        self, number: int, script: Callable[[ScriptedOperator], Script], kind: str = "TeleOp"
    ) -> ScriptedOperator:
        device = self.stage.device("operator", number)
        device.device_type = kind
        operator = ScriptedOperator(device, script)
        operator.start()
        return operator


def _act_out(stage: Stage, way: Way, trace: Path | None = None) -> list[Decided]:
    """Run until the operator is done and the robot knows."""
    scene = Scene(stage, trace)
    operator = scene.enters(1, lambda o: way(o, scene.witness))
    scene.until(lambda: operator.done and scene.robot.controller.grant is None)
    if scene.witness.trace is not None:
        scene.witness.trace.close()
    return scene.witness.decisions
