"""Missions of a robot in the hands of a person: ordered, followed, and cancelled."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.agents.device import MISSION, AgentDevice
from dva_sim.agents.operator import steps
from dva_sim.agents.operator.handheld import OnResult
from dva_sim.protocol import messages as m

STANDS_WITHIN = 3  # design: maximum attempts until a robot stands
MISSIONS = ("missions", "both")  # levels of permission


class HeldMissions:
    """Missions of one robot, which goes by itself.

    Args:
        device: The person's.
        robot: Id of the robot.
        session: Function that returns the session of the permission.

    Attributes:
        status: State of the newest mission; None if none is known.
    """

    def __init__(self, device: AgentDevice, robot: str, session: Callable[[], int]) -> None:
        self._device = device
        self._robot = robot
        self._session = session
        self.status: m.MissionStatus | None = None
        self._heard = device.network.subscribe(device.id_tag, robot, MISSION, self._on_status)

    def close(self) -> None:
        """End the subscription."""
        self._heard.close()

    def begin(self, mission: m.Body, on_result: OnResult) -> None:
        """Have the robot begin a mission, which may wait until it knows of the permission."""
        label = self._device.label_of(self._robot)
        is_over = False
        waited = 0

        def end(done: bool, text: str) -> None:
            nonlocal is_over
            if not is_over:
                is_over = True
                on_result(done, f"{label}{text}")

        def waits(reply: m.Reply) -> None:
            nonlocal waited
            waited += 1
            if reply.code == m.BUSY and waited == STANDS_WITHIN:
                end(False, f": {reply.text}")

        steps.start(
            *(self._device, self._robot, mission, self._session),
            wanted=lambda: not is_over,
            begun=lambda: end(True, " is on its way"),
            refused=lambda why: end(False, f": {why}"),
            lost=lambda: end(False, " does not answer"),
            waits=waits,
        )

    def cancel(self, on_result: OnResult) -> None:
        """Have the robot give up its mission and stand."""
        label = self._device.label_of(self._robot)

        def answered(reply: m.Reply) -> None:
            done = reply.code == m.OK
            on_result(done, f"{label}: {'the mission is cancelled' if done else reply.text}")

        def lost() -> None:
            on_result(False, f"{label} does not answer")

        self._device.ask(self._robot, m.CancelMission(), answered, lost, self._session())

    def _on_status(self, data: bytes) -> None:
        message = self._device.read(data, self._robot)
        if message is not None and isinstance(message.body, m.MissionStatus):
            self.status = message.body
