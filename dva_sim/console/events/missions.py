"""Robots that go to an event by themselves and are given back when they have looked."""

from __future__ import annotations

from functools import partial
from typing import Final

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.operator.steps import give_back, start
from dva_sim.console.asking.refusal import OnResult, unanswered
from dva_sim.console.events.decisions import why
from dva_sim.protocol import messages as m

ASK_PERIOD: Final = 3.0  # from one question how a mission stands to the next [s]
MOST_UNANSWERED: Final = 10  # of such questions in a row; then it is given back
UNDER_WAY: Final = ("under_way", "waiting", "replanning")


def inspection_of(status: m.EventStatus) -> m.Inspect:
    """Return the mission that sends a robot to look at an event."""
    return m.Inspect(status.event_id, status.kind, status.position)


def send_on_mission(
    device: AgentDevice, robot: str, label: str, body: m.Inspect, on_result: OnResult
) -> None:
    """Get the permission for a robot, and have it begin.

    Args:
        device: Device of the control room that sends it.
        robot: Id of the robot.
        label: Label of the robot.
        body: Mission with its destination.
        on_result: Callback for the result.
    """

    def granted(reply: m.Reply) -> None:
        if not isinstance(reply.content, m.Permission):
            on_result(False, f"{label}: {why(reply)}")
            return
        session = reply.content.session

        def refused(text: str) -> None:
            give_back(device, robot, session)
            on_result(False, f"{label}: {text}")

        def lost() -> None:
            give_back(device, robot, session)
            unanswered(on_result, f"{label}: it does not answer")

        def begun() -> None:
            _follow(device, robot, label, session)
            on_result(True, f"{label} goes to event {body.event_id} by itself")

        start(
            *(device, robot, body, lambda: session),
            wanted=lambda: True,
            begun=begun,
            refused=refused,
            lost=lost,
        )

    device.connect(robot)
    wish = m.PermissionRequest(robot, "missions")
    device.ask(device.dva, wish, granted, partial(unanswered, on_result))


def _follow(device: AgentDevice, robot: str, label: str, session: int) -> None:
    """Ask how a mission stands until it is over; then the robot is given back."""

    def answered(reply: m.Reply) -> None:
        status = reply.content
        if isinstance(status, m.MissionStatus) and status.mission_state in UNDER_WAY:
            device.clock.call_after(ASK_PERIOD, ask, 0)
            return
        if isinstance(status, m.MissionStatus):
            text = status.mission_state.replace("_", " ")
            device.tell(f"the mission of {label} is {text}: {status.reason}", "order")
        give_back(device, robot, session)

    def ask(silences: int) -> None:
        def lost() -> None:
            if silences < MOST_UNANSWERED:
                device.clock.call_after(ASK_PERIOD, ask, silences + 1)
                return
            device.tell(f"{label} does not answer: how its mission stands is unknown", "link")
            give_back(device, robot, session)

        device.ask(robot, m.GetMissionStatus(), answered, lost, session)

    device.clock.call_after(ASK_PERIOD, ask, 0)
