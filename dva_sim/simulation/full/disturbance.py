"""Disturbance of the first drive where a scenario has one: a refusal, at a stated moment."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.agents.device import AgentDevice
from dva_sim.kernel.recorder import DriveLog
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.dva_server import DvaAgent
from dva_sim.simulation.full.physical_world import Field
from dva_sim.simulation.full.stage import Stage

LOOK = 0.05  # interval of checks whether the drive has begun [s]


class Disturbance:
    """Waits for the first drive, and then disturbs it as the scenario says.

    Args:
        dva_of: Function that returns the DVA that grants and revokes permissions for a robot.
        field: The robots.
    """

    def __init__(self, stage: Stage, dva_of: Callable[[str], DvaAgent], field: Field) -> None:
        self._stage = stage
        self._dva_of = dva_of
        self._field = field
        self._config = stage.scenario.disturbance
        if self._config.kind == "take_over":
            self._other: AgentDevice = stage.device("operator", stage.scenario.operator.count + 1)
            self._other.label = stage.labels[self._other.id_tag] = "supervisor"
            self._other.serve(lambda message: m.Reply(message.message_id, m.OK, ""))
            self._other.register()
        if self._config.kind != "none":
            stage.clock.every(LOOK, self._look)

    def _look(self) -> bool:
        drives = self._stage.recorder.drives
        begun = bool(drives) and drives[0].started is not None
        if begun:
            self._stage.clock.call_after(self._config.after_s, self._disturb, drives[0])
        return not begun

    def _disturb(self, drive: DriveLog) -> None:
        if drive.ended is not None:
            return
        clock = self._stage.clock
        recorder = self._stage.recorder
        drive.disturbed = clock.now
        recorder.tell(clock.now, "scenario", f"disturbs the drive: {self._config.kind}", "drive")
        if self._config.kind == "refuse":
            self._field.robots[drive.robot].refuses = m.NOT_PERMITTED
            return
        takes = self._other.id_tag if self._config.kind == "take_over" else None
        self._dva_of(drive.robot).revoke(drive.robot, takes, self._config.holder_told)
