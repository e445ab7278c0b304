"""Scene of a storm: the run, its devices by label, an intruder, restarts of the DVA."""

from __future__ import annotations

import random
import sqlite3
from collections.abc import Callable, Iterator
from functools import cached_property, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.robot.faults import RobotFaults
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.core.store import Store
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.protocol.codec import decode
from dva_sim.protocol.exchange import NOON
from dva_sim.protocol.messages import PermissionGrant, Position
from dva_sim.simulation.full.run import Run, Watched
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.storms.drivers import BusyDriver
from dva_sim.storms.interference import Interference, PassingMessage
from dva_sim.storms.intruder import NUMBER, Intruder
from dva_sim.storms.plan import StormPlan
from dva_sim.storms.releaser import Releaser


class Killed(BaseException):
    """End of the DVA's process: nothing of what it was about to do happens."""


class DvaLives:
    """Lives of the DVA of a run: kills, restarts, and a full disk under its memory.

    Args:
        file: File of its memory.
        down: Callback with True when it is killed, and with False when it is back.

    Attributes:
        memory: Memory since the last restart.
        kills: Number of kills.
        full: Number of faults that keep the disk full now.
        lost: Time for which the last life could write nothing before it was killed [s].
    """

    def __init__(self, file: Path, down: Callable[[bool], object]) -> None:
        self._down = down
        self._file = file
        self.kills = 0
        self.full = 0
        self.lost = 0.0
        self._wrote_at = 0.0
        self._run: Run | None = None
        self._away = 0.0
        self._is_away = False
        self._writes_left: int | None = None
        self.memory = self._opened()

    def _opened(self) -> Store:
        self._writes_left = None
        memory = Store(self._file)
        memory.between_writes = self._between_writes
        return memory

    def _between_writes(self) -> None:
        """Raise what a full disk or a kill at this write would cause."""
        if self._writes_left is not None:
            self._writes_left -= 1
            if self._writes_left < 0:
                raise Killed
        if self.full:
            raise sqlite3.OperationalError("database or disk is full")
        if self._run is not None:
            self._wrote_at = self._run.clock.now

    def begin(self, run: Run) -> None:
        """Take over the DVA of a run that was made with this memory."""
        self._run = run

    def kill(self, away: float) -> None:
        """Kill the DVA now, and restart it after a time `away` [s]."""
        run = self._run
        assert run is not None
        if self._is_away:
            return
        self.kills += 1
        self._is_away = True
        self.lost = run.clock.now - self._wrote_at if self.full else 0.0
        assert isinstance(run.network, VirtualNetwork)
        run.network.leave(DVA)
        run.dva.crash()
        self._down(True)
        run.clock.call_after(away, self._back)

    def kill_at_write(self, number: int, away: float) -> None:
        """Kill the DVA at one of its next writes, which is lost."""
        self._writes_left = number
        self._away = away

    def survive(self, until: float) -> None:
        """Advance time, through any death in the middle of a write."""
        run = self._run
        assert run is not None
        while True:
            try:
                run.clock.run(until)
            except Killed:
                self.kill(self._away)
            else:
                return

    def _back(self) -> None:
        run = self._run
        assert run is not None
        self._is_away = False
        self.memory = self._opened()
        run.start_dva(self.memory)
        assert isinstance(run.network, VirtualNetwork)
        run.network.come_back(DVA)
        self._down(False)


FLOODER = NUMBER + 1  # number of the flooding intruder, which never holds a robot
FITS = 0.8  # free space around a place to which robots are sent [m]


class StormRobot(NamedTuple):
    """Robot of a storm, with its faults."""

    id: str
    agent: RobotAgent
    faults: RobotFaults


class StormScene:
    """A run in virtual time in which anything may be made to go wrong.

    Args:
        plan: The storm.
        folder: Folder of the DVA's memory.

    Attributes:
        run: The run.
        recorder: Recorder of the run.
        interference: Control over the delivery of messages.
        intruder: Dishonest device.
        flooder: Device that sends more than any other can process, and holds nothing.
        releaser: Person who releases robots after emergencies.
        dva: Kills and restarts of the DVA.
        robots: All robots.
        guards: Ids of the guards.
        operators: Ids of the operators of the scenario.
        drivers: Drivers that are never idle, by label.
        labelled: Ids by label.
    """

    def __init__(self, plan: StormPlan, folder: Path) -> None:
        self.plan = plan
        self.recorder = Recorder(False)
        self.dva = DvaLives(folder / "dva.sqlite", self.dva_is_down)
        clock = Clock()
        watched = Watched(
            clock, self.recorder, memory=self.dva.memory, time_of_day=(NOON, True), keeps=False
        )
        self.run = run = Run(plan.built(), plan.seed, watched=watched)
        self.dva.begin(run)
        self.robots = [
            StormRobot(i, r, RobotFaults(r, self._lost)) for i, r in run.field.robots.items()
        ]
        self.guards = self._ids("guard", run.scenario.guard.count)
        self.operators = self._ids("operator", run.scenario.operator.count)
        self.drivers = {each.device.label: each for each in self._make_drivers()}
        self.labelled = {label: id_tag for id_tag, label in run.stage.labels.items()}
        self.interference = Interference(clock, self.arrives)
        assert isinstance(run.network, VirtualNetwork)
        run.network.interference = self.interference
        self.intruder = Intruder(run.stage)
        self.flooder = Intruder(run.stage, FLOODER, "intruder-2")
        chance = random.Random(f"{plan.seed} releaser")
        self.releaser = Releaser(run.stage, run.field.robots, chance)
        self.releaser.start()
        self._sessions: dict[str, list[int]] = {}

    def _make_drivers(self) -> Iterator[BusyDriver]:
        stage = self.run.stage
        robots = [robot.id for robot in self.robots]
        sensors = tuple(sorted(self.robots[0].agent.sensors))
        for number in range(1, self.plan.drivers + 1):
            chance = random.Random(f"{self.plan.seed} driver {number}")
            place = partial(self.free_place, chance)
            driver = BusyDriver(stage, number, robots, sensors=sensors, chance=chance, place=place)
            driver.start(self.plan.calm_s)
            yield driver

    @staticmethod
    def _ids(kind: str, count: int) -> list[str]:
        return [id_of(kind, number) for number in range(1, count + 1)]

    def arrives(self, passing: PassingMessage) -> None:
        """Let a message reach its receiver."""
        passing.take(passing.payload)

    def answered(self, node: str, to: str, reply: bytes) -> None:
        """Pass an answer of a node to the audit, even if it reaches nobody."""
        self.run.audit.sent(self.now, node, to, reply)

    def dva_is_down(self, is_down: bool) -> None:
        """Note that the DVA was killed, or is back."""

    def _lost(self, robot: str, reply: bytes) -> None:
        self.answered(robot, "", reply)

    @property
    def now(self) -> float:
        """Time [s]."""
        return self.run.clock.now

    def id_of(self, label: str) -> str:
        """Return the id of a device by its label; an empty label has none."""
        return self.labelled[label] if label else ""

    def robot(self, label: str) -> StormRobot:
        """Return a robot by its label."""
        return next(robot for robot in self.robots if robot.id == self.labelled[label])

    def device(self, label: str) -> AgentDevice:
        """Return a device by its label."""
        id_tag = self.labelled[label]
        return next(d for d in reversed(self.run.stage.devices) if d.id_tag == id_tag)

    def anywhere(self, chance: random.Random) -> Position:
        """Draw a place within the bounds of the site, in walls or not."""
        site = self.run.stage.site
        low_x, low_y, high_x, high_y = site.extent
        x = chance.uniform(low_x, high_x)
        y = chance.uniform(low_y, high_y)
        return Position(*site.frame.to_latlon(x, y))

    @cached_property
    def _free(self) -> tuple[NDArray[np.int_], ...]:
        return self.run.stage.site.grid.reachable(FITS).nonzero()

    def free_place(self, chance: random.Random) -> Position:
        """Draw a place where a robot fits."""
        site = self.run.stage.site
        rows, columns = self._free
        number = chance.randrange(len(rows))
        x, y = site.grid.to_xy(rows[number] + 0.5, columns[number] + 0.5)
        return Position(*site.frame.to_latlon(float(x), float(y)))

    def sessions_seen(self, robot: str) -> list[int]:
        """Return the newest sessions in which a robot was granted to somebody."""
        return self._sessions.get(robot, [])[-8:]

    def note_session(self, source: str, to: str, data: bytes) -> None:
        """Note a session in which the DVA grants a robot to somebody."""
        if source == DVA and b"<PermissionGrant" in data:
            body = decode(data).body
            if isinstance(body, PermissionGrant):
                self._sessions.setdefault(to, []).append(body.session)
