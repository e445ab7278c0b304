"""Actions at a robot's windows: driving it by hand, and injecting faults.

The page only says what it wants, again and again while something is held; the robot's controller
decides. A page that falls silent, is hidden or is left, so asks for standstill.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from dva_sim.agents.robot.controller import Decision
from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.robots.robot_windows import RobotWindow, RobotWindows
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.arguments import FaultSwitch, OfRobot, Wish
from dva_sim.console.wire.limits import SILENT_AFTER
from dva_sim.protocol import messages as m


@dataclass
class PageHand:
    """A page that has a robot in hand.

    Attributes:
        robot: Its id.
        heard: Time of its newest input, real time [s].
        holds: True if that input was held.
    """

    robot: str
    heard: float = 0.0
    holds: bool = False


class RobotActions:
    """Does what the windows of robots ask for.

    Args:
        windows: Windows of all robots.
        robot: Function that returns the id of a robot by its name in a line.
        why_not: Reason why nobody may drive now; empty if driving is allowed.
        labels: Labels of all devices, by id.
        deaf: Callback when a robot's computer is made to hang, or to work again.
        slow: Callback with the processing time set for a robot's computer [s].
    """

    def __init__(
        self,
        windows: RobotWindows,
        robot: Callable[[Any], str],
        *,
        why_not: Callable[[], str],
        labels: Mapping[str, str],
        deaf: Callable[[str, bool], object],
        slow: Callable[[float], object],
    ) -> None:
        self._windows = windows
        self._robot = robot
        self._why_not = why_not
        self._labels = labels
        self._deaf = deaf
        self._slow = slow
        self._hands: dict[str, PageHand] = {}  # by client
        self._count = 0

    # --- by hand -----------------------------------------------------------------------

    @does("manual_take")
    def _take(self, client: str, line: OfRobot, on_result: OnResult) -> None:
        robot = self._robot(line["robot"])
        window = self._windows.by_id[robot]
        if why := self._why_not():
            raise Refused(why)
        if (state := window.station.line()["state"]) != "listening":
            raise Refused(f"The robot is {state}. It must be registered and listening first.")
        mine = self._hands.get(client)
        if mine is not None and mine.robot != robot:
            self._let_go(client, mine)
        self._must(window.hand.take(client))
        if mine is None or mine.robot != robot or window.number is None:
            self._count += 1
            window.number = self._count
            window.notice = ""
            self._hands[client] = PageHand(robot)
        on_result(True, "manual control is yours", hand=window.number)

    def _must(self, decision: Decision) -> None:
        """Refuse what the robot refuses, by names that people know.

        Raises:
            Refused: the robot does not obey.
        """
        if decision.code != m.OK:
            text = decision.text
            for id_tag, label in self._labels.items():
                text = text.replace(id_tag, label)
            raise Refused(f"{m.CODE_NAMES[decision.code]}: {text}")

    @does("manual_release")
    def _release(self, client: str, _: Asked, on_result: OnResult) -> None:
        hand = self._hands.get(client)
        if hand is not None:
            self._let_go(client, hand)
        on_result(True, "released")

    def _let_go(self, client: str, hand: PageHand) -> None:
        del self._hands[client]
        window = self._windows.by_id[hand.robot]
        if window.hand.let_go(client).code == m.OK:
            window.number = None

    @does("manual")
    def input(self, client: str, line: Wish) -> None:
        """Steer as a hand wants now, in shares of the limits; letting go asks for a stop."""
        hand = self._hands.get(client)
        if hand is None:
            return
        held = line["held"] and not self._why_not()
        hand.heard = time.monotonic()
        hand.holds = held
        if held:
            self._drive(client, hand, line["speed"], line["turn"])
        else:
            self._drive(client, hand, 0.0, 0.0)

    def _drive(self, client: str, hand: PageHand, speed: float, turn: float) -> None:
        window = self._windows.by_id[hand.robot]
        spec = window.robot.body.spec
        set_point = speed * spec.max_speed, turn * spec.max_turn_rate
        if window.hand.drive(client, *set_point).code == m.WRONG_MODE:
            del self._hands[client]  # an emergency, or a long silence, has ended it

    def gone(self, client: str) -> None:
        """End what a hidden or closed page has in hand."""
        hand = self._hands.get(client)
        if hand is not None:
            hand.holds = False
            self._drive(client, hand, 0.0, 0.0)

    def look_for_the_silent(self) -> None:
        """Stop the robot of a page that held it and has fallen silent."""
        now = time.monotonic()
        for client, hand in list(self._hands.items()):
            if hand.holds and now - hand.heard > SILENT_AFTER:
                self.gone(client)
        self._windows.look()

    def stop(self, robots: Iterable[str]) -> None:
        """Stop these robots: an emergency, or time stands still, or the machine lags."""
        stopped = set(robots)
        for client, hand in list(self._hands.items()):
            if hand.robot in stopped:
                self.gone(client)

    def press_emergency(self, robot: str) -> None:
        """Press the button at the robot itself."""
        self._windows.by_id[robot].hand.press_emergency()

    def release_emergency(self, robot: str, who: str) -> Decision:
        """Release a robot at the robot itself."""
        return self._windows.by_id[robot].hand.release(who)

    # --- faults ------------------------------------------------------------------------

    @does("fault")
    def _fault(self, _: str, line: FaultSwitch, on_result: OnResult) -> None:
        robot = self._robot(line["robot"])
        what = line["what"]
        window = self._windows.by_id[robot]
        on = line["on"]
        if what == "processing":
            seconds = line.get("seconds", 0.0)
            window.faults.slow_down(seconds if on else None)
            self._slow(seconds if on else 0.0)
        elif what == "replies":
            window.faults.drop_replies(on)
        elif what == "freeze":
            self._deaf(robot, on)
            window.faults.freeze(on)
        elif what == "camera":
            window.faults.lose_camera(on)
        else:
            self._stick(window, line.get("sensor", ""), on)
        on_result(True, f"{what}: {'on' if on else 'off'}")

    def _stick(self, window: RobotWindow, sensor: str, on: bool) -> None:
        if sensor not in window.robot.sensors:
            there = ", ".join(window.robot.sensors) or "none"
            raise Refused(f"there is no sensor {sensor!r}; sensors: {there}")
        window.faults.stick(sensor, on)
