"""Person in a storm who releases robots some time after each emergency."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable
from functools import partial
from typing import Final

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.device import EMERGENCY, do_nothing
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.stage import Stage

NUMBER: Final = 2
LABEL: Final = f"control-room-{NUMBER}"
ROLE: Final = "dispatch"
THINKS_S: Final = 1.0, 20.0  # shortest and longest time from an emergency to its release [s]
LOOKS_AGAIN_S: Final = 15.0  # time after which a robot that is still held is released again [s]


class Releaser:
    """Control room that hears of emergencies from the robots, and releases them.

    Args:
        stage: Stage of the run.
        robots: Ids of the robots.
        chance: Random numbers of its person.
    """

    def __init__(self, stage: Stage, robots: Iterable[str], chance: random.Random) -> None:
        self.room = ControlRoomAgent(stage.device("control-room", NUMBER))
        self._chance = chance
        self._decided: dict[str, int] = {}  # tick of the emergency, by robot
        self._robots = tuple(robots)

    def start(self) -> None:
        """Register, and listen to the robots."""
        device = self.room.device
        self.room.start()
        for robot in self._robots:
            heard = partial(self._on_emergency, robot)
            device.network.subscribe(device.id_tag, robot, EMERGENCY, heard)

    def release(
        self,
        robot: str,
        answered: Callable[[m.Reply], object] = do_nothing,
        failed: Callable[[], object] = do_nothing,
    ) -> None:
        """Ask the DVA to release a robot."""
        self.room.ask(m.ReleaseEmergency(robot), answered, failed)

    def _on_emergency(self, robot: str, data: bytes) -> None:
        message = self.room.device.read(data, robot)
        if message is None or not isinstance(message.body, m.RobotEmergency):
            return
        emergency = message.body
        if emergency.released is None and self._decided.get(robot) != emergency.tick:
            self._decided[robot] = emergency.tick
            self.room.device.clock.call_after(
                self._chance.uniform(*THINKS_S), self._decide, robot, emergency.tick
            )

    def _decide(self, robot: str, tick: int) -> None:
        """Release a robot; if the release gets lost, the next report is decided on again."""

        def forget() -> None:
            if self._decided.get(robot) == tick:
                del self._decided[robot]

        def answered(reply: m.Reply) -> None:
            if reply.code != m.OK:
                forget()
            else:  # a DVA killed before it can write forgets the release
                self.room.device.clock.call_after(LOOKS_AGAIN_S, forget)

        if self._decided.get(robot) == tick:
            self.release(robot, answered, forget)
