"""Actions at the page of a robot that runs alone: each is done once, and answered once."""

from __future__ import annotations

from dva_sim.console.asking.dispatcher import ActionDispatcher, does
from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.robots.robot_actions import RobotActions
from dva_sim.console.simulator.robot_world import RobotWorld
from dva_sim.console.wire.actions import ActionPlace, Asked
from dva_sim.console.wire.arguments import (
    LogsLooked,
    Nothing,
    OfRobot,
    OfSome,
    RegistrationAsked,
    RobotsWatched,
)
from dva_sim.console.wire.seats import DoneLine
from dva_sim.network.addresses import check_address
from dva_sim.protocol import messages as m

LOOK = 0.05  # from one look at who has fallen silent to the next, real time [s]


class LoneRobotActions:
    """Does what lines of the web process ask for.

    Args:
        world: The robot.

    Attributes:
        take: Does what a line asks for.
    """

    def __init__(self, world: RobotWorld) -> None:
        self._world = world
        self._hands = RobotActions(
            world.windows,
            lambda _: world.robot.device.id_tag,
            why_not=lambda: "held: this machine cannot keep up" if world.lag.held else "",
            labels=world.stage.labels,
            deaf=world.deafen,
            slow=world.slowed,
        )
        self.take = ActionDispatcher(
            *(ActionPlace.ROBOT, (self, self._hands), self._tell),
            "a robot that runs alone does not know {what!r}",
            lambda: world.audited,
        ).take
        world.hold = lambda _: self._hands.stop(world.field.robots)
        world.clock.pulse(LOOK, self._hands.look_for_the_silent)

    def _tell(self, answer: DoneLine) -> None:
        self._world.tell({**answer, "t": self._world.feed.now_ms})
        self._world.tell_now()

    @does("emergency")
    def _emergency(self, _: str, line: OfSome, on_result: OnResult) -> None:
        self._hands.stop(self._world.field.robots)
        self._hands.press_emergency(self._world.robot.device.id_tag)
        on_result(True, f"{self._world.robot.device.label} has stopped")

    @does("robot_release")
    def _release_emergency(self, client: str, line: OfRobot, on_result: OnResult) -> None:
        robot = self._world.robot
        decision = self._hands.release_emergency(robot.device.id_tag, client)
        on_result(decision.code == m.OK, decision.text)

    @does("robot_register")
    def _register(self, _: str, line: RegistrationAsked, on_result: OnResult) -> None:
        dva = line["dva"].strip()
        check_address(dva)
        self._world.station.register(dva, on_result)

    @does("robot_listen")
    def _listen(self, _: str, line: OfRobot, on_result: OnResult) -> None:
        self._world.station.listen()
        on_result(True, f"listens on {self._world.robot.device.address}")

    @does("robot_off")
    def _off(self, _: str, line: OfRobot, on_result: OnResult) -> None:
        self._world.station.switch_off()
        on_result(True, "it is off")

    @does("release")
    def _release(self, _: str, line: Nothing, on_result: OnResult) -> None:
        """Nothing is in hand but by `manual_take`."""
        on_result(True, "released")

    @does("gone")
    def _gone(self, client: str, _: Asked) -> None:
        self._hands.gone(client)

    @does("watch")
    def _watch(self, _: str, line: RobotsWatched) -> None:
        own = {self._world.robot.device.id_tag}
        self._world.screens.watch(own if line["robots"] else set())

    @does("look")
    def _look(self, _: str, line: LogsLooked) -> None:
        self._world.logs.look(line["logs"])
