"""The parts of a live run, each of which can be a process of its own."""

from __future__ import annotations

import math
import secrets
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from dva_sim.agents.operator.operator import OperatorAgent
from dva_sim.agents.operator.scripted import ScriptedOperator, drill
from dva_sim.agents.robot.decision_log import DecisionLog
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.cameras.service import CameraService
from dva_sim.core.events import Event
from dva_sim.core.sessions import Permissions
from dva_sim.core.store import Store
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.rates import Rate
from dva_sim.kernel.suggestions import either
from dva_sim.live.kept_facts import keep_events, keep_places, keep_team
from dva_sim.live.open_files import room_here
from dva_sim.live.options import ROSBRIDGE, trace_of
from dva_sim.live.recording import LiveRecorder, TraceFile, TraceLines
from dva_sim.network.messaging import Transport
from dva_sim.network.realtime import LiveClock
from dva_sim.options.runs import PARTS, LiveOptions
from dva_sim.protocol.exchange import LOW_BITS
from dva_sim.ros.gateway import RosGateway
from dva_sim.ros.server import RosbridgeServer
from dva_sim.serving.open_port import OpenPort
from dva_sim.simulation.full.control_room import add_dispatcher, add_dva, add_operator
from dva_sim.simulation.full.device_table import BookedDevice, DeviceTable
from dva_sim.simulation.full.dva_trace import traced
from dva_sim.simulation.full.observations import STATIONARY, FactLog, motion_of, page_of
from dva_sim.simulation.full.physical_world import Field
from dva_sim.simulation.full.run import FILM_PERIOD, WATCH_PERIOD
from dva_sim.simulation.full.stage import Stage
from dva_sim.simulation.scenario import Scenario

SESSION_EPOCH = 1_735_689_600  # 2025-01-01, UTC [s]
SESSIONS_PER_SECOND = 4  # 32 bits last for 34 years

Row = dict[str, Any]


class LivePart(Protocol):
    """Process of a live run."""

    def rows(self) -> list[Row]:
        """Return a table row per device, with what this part knows."""

    def settled(self) -> bool:
        """Return True if this part expects no further activity."""

    def has_company(self) -> bool:
        """Return True if a device that this part depends on has ever answered."""

    def keep(self, recorder: LiveRecorder) -> None:
        """Write changes to the recording, once a second."""

    def finish(self) -> None:
        """Bring everything into a safe state; last messages are still sent."""


def _make_trace(label: str, stage: Stage, options: LiveOptions) -> Callable[[str], object] | None:
    """Return the writer of a decider's trace, for a robot or the DVA; None without tracing."""
    recorder = stage.recorder
    if isinstance(recorder, LiveRecorder) and recorder.keeps:
        return TraceLines(recorder, label)
    if options.record is None:
        return None
    path = options.record / trace_of(label)
    return TraceFile(path, lambda text: recorder.tell(stage.clock.now, label, text, "link"))


class DvaPart:
    """The DVA core.

    Attributes:
        agent: The DVA.
        aside: Own devices, which do not count as company.

    Raises:
        ConfigError: the state file cannot be used.
    """

    def __init__(self, stage: Stage, options: LiveOptions, number: int = 1) -> None:
        # Session numbers start at a value that nobody can guess and that grows with the date. They
        # are higher than before a restart, unless the DVA granted more than SESSIONS_PER_SECOND or
        # the clock was set back; then robots, which ask the DVA, accept lower ones. The clock may
        # also have no date at all.
        count = max(1, int((time.time() - SESSION_EPOCH) * SESSIONS_PER_SECOND))
        permissions = Permissions(lambda: secrets.randbits(LOW_BITS), count=count)
        memory = None
        if options.state is not None:
            memory = Store(_state_file(options.state, stage, number))
        life = int(time.time())
        self.agent = add_dva(
            stage, permissions, memory, keep_events=False, number=number, life=life
        )
        room = room_here()
        self.agent.core.registry.most = room.devices
        self.agent.device.tell(str(room), "link")
        self.agent.stopwatch = time.perf_counter
        trace = _make_trace("dva", stage, options)
        if trace is not None and stage.regions is None:
            self.agent.core = traced(self.agent.core, trace, stage, memory)
        if isinstance(stage.recorder, LiveRecorder):
            self._observe(stage.recorder, stage)
        self.agent.start()
        self._dispatcher = add_dispatcher(stage)
        self._stage = stage
        events = self.agent.core.events
        self._scripted = options.operators == "scripted"  # scripted operators do not settle events
        self._settled_before = 0 if events.open else events.total
        self._table = DeviceTable(lambda: self.agent)
        self.aside: set[str] = set()

    def _observe(self, recorder: LiveRecorder, stage: Stage) -> None:
        """Record all decisions, and the device table twice a second."""
        agent = self.agent
        clock = stage.clock
        agent.on_fact = lambda fact: recorder.put("fact", fact.row())
        log = FactLog(
            recorder.observe,
            (),
            lambda _: STATIONARY,
            lambda _: page_of(agent),
            dvas={agent.device.id_tag},
            keeps_sent=False,
        )
        recorder.log = log
        clock.every(WATCH_PERIOD, lambda: log.shows(clock.now, page_of(agent)))

    def keep(self, recorder: LiveRecorder) -> None:
        """Record the states of events."""
        keep_events(recorder, self.agent.core.events)

    def rows(self) -> list[Row]:
        """Return a row for each of the first devices, with present devices first."""
        return [_device_row(booked) for booked in self._table.rows()]

    def events(self) -> list[Row]:
        """Return the events known to the DVA."""
        return [{"number": e.number, "kind": e.kind, "state": str(e.state)} for e in self._events()]

    def settled(self) -> bool:
        """Implement `LivePart`."""
        events = self.agent.core.events
        return self._scripted or (events.total > self._settled_before and not events.open)

    def _events(self) -> list[Event]:
        """Return all open events and the last closed ones."""
        events = self.agent.core.events
        return [*events.closed.values(), *events.open.values()]

    def has_company(self) -> bool:
        """Return True if any device has registered."""
        return not self.agent.core.registry.entries.keys() <= self.aside

    def finish(self) -> None:
        """Revoke all permissions."""
        self.agent.close()


def _state_file(path: Path, stage: Stage, number: int) -> Path:
    """Return the state file of a DVA; each of several DVAs has its own."""
    if stage.regions is None:
        return path
    return path.with_name(f"{path.stem}-{stage.regions.names[number - 1]}{path.suffix}")


def _device_row(booked: BookedDevice) -> Row:
    return {
        "label": booked.device.label,
        "type": booked.device.device_type,
        "address": booked.device.address,
        "heard_s": booked.heard_s,
        "beats_hz": booked.beats_hz,
        "silent": booked.silent,
        "order": booked.order,
    }


@dataclass(frozen=True)
class _FilmedWorld:
    """The world for the camera service; see `FilmedRun`."""

    scenario: Scenario
    clock: Clock
    network: Transport
    field: Field


class WorldPart:
    """Robots, guards, hazards and the physics of a site."""

    def __init__(self, stage: Stage, options: LiveOptions) -> None:
        self._stage = stage
        self._field = Field(stage)
        self._field.populate()
        self._field.schedule_incidents()
        self._commands: dict[str, Rate] = {}
        self._scripted = options.operators == "scripted"
        for label, robot in ((r.device.label, r) for r in self._field.robots.values()):
            trace = _make_trace(label, stage, options)
            robot.trace = None if trace is None else DecisionLog(trace, robot.controller)
        if isinstance(stage.recorder, LiveRecorder):
            self._observe(stage.recorder)

    def _observe(self, recorder: LiveRecorder) -> None:
        """Record accepted commands, motion of robots, and all positions."""
        robots = self._field.robots
        log = FactLog(
            recorder.observe, robots, lambda robot: motion_of(robots[robot]), keeps_sent=False
        )
        recorder.log = log
        recorder.on_accepted = log.accepted
        recorder.on_hand = log.by_hand
        clock = self._stage.clock
        clock.every(FILM_PERIOD, partial(self._sample, recorder, log))
        clock.every(WATCH_PERIOD, lambda: log.places(clock.now, self._field.places()))

    def film(self, service: CameraService) -> None:
        """Let a service serve the pictures of the robots."""
        stage = self._stage
        run = _FilmedWorld(stage.scenario, stage.clock, stage.network, self._field)
        service.film(run, stage.seed)
        if isinstance(stage.recorder, LiveRecorder):
            stage.recorder.put("cameras", service.base)

    def _sample(self, recorder: LiveRecorder, log: FactLog) -> None:
        now = self._stage.clock.now
        robots = self._field.robots.items()
        keep_places(recorder, self._field, now)
        log.moves(now, {name: motion_of(robot) for name, robot in robots})

    def keep(self, recorder: LiveRecorder) -> None:
        """Record the team and the contained hazards."""
        keep_team(recorder, self._stage.labels, self._field)

    def rows(self) -> list[Row]:
        """Return a row for each robot and guard."""
        now = self._stage.clock.now
        self._field.world.advance_to(now)
        robots = [self._robot_row(robot, now) for robot in self._field.robots.values()]
        guards = [
            {"label": g.device.label, "doing": g.activity, "at": [g.x, g.y]}
            for g in self._field.guards
        ]
        return robots + guards

    def _robot_row(self, robot: RobotAgent, now: float) -> Row:
        pose = robot.body.pose()
        label = robot.device.label
        rate = self._commands.setdefault(label, Rate()).of(robot.applied, now)
        return {
            "label": label,
            "doing": robot.controller.mode.value,
            "commands_hz": rate,
            "refused": robot.refused,
            "picture_age_s": robot.picture_age if rate else None,
            "at": [pose.x, pose.y],
            "speed_mps": robot.body.speed,
        }

    def settled(self) -> bool:
        """Return True if all events were reported or need no script, and all robots are idle."""
        detected = [i.detected for i in self._field.incidents if i.detected < math.inf]
        is_settled = self._stage.clock.now > max(detected, default=0.0) + 2.0
        return (is_settled or self._scripted) and all(
            r.controller.owner is None for r in self._field.robots.values()
        )

    def has_company(self) -> bool:
        """Return True if the DVA has answered a robot or guard."""
        robots = [robot.device for robot in self._field.robots.values()]
        devices = [*robots, *(guard.device for guard in self._field.guards)]
        return any(device.round_trips for device in devices)

    def finish(self) -> None:
        """Do nothing: robots stop by themselves."""


class OperatorPart:
    """One operator: a simulated person, or a script."""

    def __init__(self, stage: Stage, options: LiveOptions, number: int) -> None:
        self._stage = stage
        self._sent = Rate()
        if options.operators == "scripted":
            self._agent: OperatorAgent | ScriptedOperator = ScriptedOperator(
                stage.device("operator", number), drill
            )
            self._agent.start()
        else:
            self._agent = add_operator(stage, number)

    def rows(self) -> list[Row]:
        """Return a row with the operator's activity and the phone's measurements of the link."""
        now = self._stage.clock.now
        agent = self._agent
        row: Row = {"label": agent.device.label, "doing": agent.activity}
        sent = (
            agent.asked
            if isinstance(agent, ScriptedOperator)
            else sum(drive.sent for drive in self._stage.recorder.drives)
        )
        row["commands_hz"] = self._sent.of(sent, now)
        trips = agent.device.round_trips
        row["round_trip_s"] = statistics.median(trips) if trips else None
        return [row]

    def keep(self, recorder: LiveRecorder) -> None:
        """Record the progress of drives."""
        recorder.catch_up()

    def settled(self) -> bool:
        """Implement `LivePart`."""
        return self._agent.activity in ("done", "waiting")

    def has_company(self) -> bool:
        """See `LivePart`: the DVA has answered."""
        return bool(self._agent.device.round_trips)

    def finish(self) -> None:
        """Order a robot that is still driven to stop."""
        self._agent.put_down()


class RosbridgePart:
    """Serves the robots of the run to clients of ROS, from the robots' messages."""

    def __init__(self, stage: Stage, door: OpenPort) -> None:
        clock = stage.clock
        assert isinstance(clock, LiveClock)
        self._gateway = RosGateway(stage)
        recorder = stage.recorder
        self._server = RosbridgeServer(
            clock,
            port=door,
            gateway=self._gateway,
            site=stage.site,
            tell=lambda what: recorder.tell(clock.now, ROSBRIDGE, what, "link"),
        )

    def rows(self) -> list[Row]:
        """Return nothing: the devices are in the rows of the DVA."""
        return []

    def keep(self, recorder: LiveRecorder) -> None:
        """Record the progress of clients' drives."""
        recorder.catch_up()

    def settled(self) -> bool:
        """Return True if no client controls a robot."""
        return not self._gateway.is_driving

    def has_company(self) -> bool:
        """See `LivePart`: the DVA has answered."""
        return bool(self._gateway.device.round_trips)

    def finish(self) -> None:
        """Stop the robots that clients drive."""
        self._server.close()


def make_part(
    name: str, stage: Stage, options: LiveOptions, number: int, door: OpenPort | None = None
) -> LivePart:
    """Return the part of that name; `number` says which operator, or which DVA.

    Raises:
        ConfigError: the scenario has no such operator, or no place for its team.
    """
    if name == ROSBRIDGE and door is not None:
        return RosbridgePart(stage, door)
    if name not in PARTS:
        raise ConfigError(f"--only {name!r} should be {either(PARTS)}")
    if name == "operator" and not 1 <= number <= stage.scenario.operator.count:
        count = stage.scenario.operator.count
        has = f"the scenario has {count or 'no'} operator{'s' * (count != 1)}"
        raise ConfigError(f"--number {number}: {has}")
    makers: dict[str, Callable[[], LivePart]] = {
        "dva": lambda: DvaPart(stage, options, number),
        "world": lambda: WorldPart(stage, options),
        "operator": lambda: OperatorPart(stage, options, number),
    }
    return makers[name]()
