"""Robots that are released after emergencies, or taken from their holders, by the DVA."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Final

from dva_sim.console.asking.refusal import OnResult, unanswered
from dva_sim.protocol import messages as m

NOBODY_STOPPED: Final = "no robot is stopped by an emergency"
AskDva = Callable[[m.Body, Callable[[m.Reply], object], Callable[[], object]], object]


def release_robots(
    robots: Collection[str], labels: Mapping[str, str], ask: AskDva, on_result: OnResult
) -> None:
    """Ask the DVA to release robots, and answer once it has answered for each.

    Args:
        robots: Ids of the robots.
        labels: Labels by id.
        ask: Sends a request to the DVA.
        on_result: Callback for the result.
    """
    waiting = set(robots)
    refusals: list[str] = []

    def ended(robot: str, reply: m.Reply | None = None) -> None:
        waiting.discard(robot)
        label = labels.get(robot, robot)
        if reply is None:
            refusals.append(f"{label}: no answer of the DVA")
        elif reply.code != m.OK:
            refusals.append(f"{label}: {reply.text}")
        if waiting:
            return
        if not refusals:
            on_result(True, f"{', '.join(labels.get(each, each) for each in robots)}: released")
        elif reply is None:
            unanswered(on_result, "; ".join(refusals))
        else:
            on_result(False, "; ".join(refusals))

    for robot in robots:
        ask(m.ReleaseEmergency(robot), partial(ended, robot), partial(ended, robot))


def revoke_permission(robot: str, label: str, ask: AskDva, on_result: OnResult) -> None:
    """Ask the DVA to end the permission for a robot.

    Args:
        robot: Id of the robot.
        label: Label of the robot.
        ask: Sends a request to the DVA.
        on_result: Callback for the result.
    """

    def answered(reply: m.Reply) -> None:
        text = reply.reason
        on_result(reply.code == m.OK, f"{label}: {text}")

    ask(m.Revoke(robot), answered, partial(unanswered, on_result))
