"""What pages of a robot that runs alone ask for: each action is done once, and answered once."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from dva_sim.console.answers import Answers
from dva_sim.console.refusal import Refused, Said
from dva_sim.console.robot_actions import RobotActions
from dva_sim.console.robot_world import RobotWorld
from dva_sim.network.addresses import check_address

Line = dict[str, Any]
LOOK = 0.05  # from one look at who has fallen silent to the next, real time [s]


class RobotDesk:
    """Does what lines of the web process ask for.

    Args:
        world: The robot.
    """

    def __init__(self, world: RobotWorld) -> None:
        self._world, self._answers = world, Answers()
        self._hands = RobotActions(
            world.windows,
            lambda _: world.robot.device.id_tag,
            why_not=lambda: "held: this machine cannot keep up" if world.lag.held else "",
            labels=world.stage.labels,
            deaf=world.deafen,
            slow=world.slowed,
        )
        world.hold = lambda _: self._hands.stop(world.field.robots)
        world.clock.pulse(LOOK, self._hands.look_for_the_silent)
        self._doers: dict[str, Callable[[str, Line, Said], object]] = {
            **self._hands.doers,
            "emergency": self._emergency,
            "robot_register": self._register,
            "robot_listen": self._listen,
            "robot_off": self._off,
            "release": lambda client, line, said: said(True, "released"),
        }

    def take(self, line: Line) -> None:
        """Do what a line asks for; nothing that it can hold does any harm."""
        what, client = line.get("do"), str(line.get("client", ""))
        if what == "manual":
            self._hands.input(client, line)
        elif what == "gone":
            self._hands.gone(client)
        elif what == "watch":
            numbers = line.get("robots")
            watched = isinstance(numbers, list) and bool(numbers)
            self._world.screens.watch({self._world.robot.device.id_tag} if watched else set())
        elif what == "look":
            logs = line.get("logs")
            if isinstance(logs, dict):
                self._world.logs.look({str(name): bool(all_) for name, all_ in logs.items()})
        elif isinstance(number := line.get("id"), str):
            self._answers.once(
                number,
                partial(self._do, client, str(what), line),
                self._tell,
                repeats=what == "emergency",
            )

    def _do(self, client: str, what: str, line: Line, said: Said) -> None:
        do = self._doers.get(what)
        if do is None:
            raise Refused(f"a robot that runs alone does not know {what!r}")
        do(client, line, said)

    def _tell(self, answer: Line) -> None:
        self._world.tell({**answer, "t": self._world.feed.now_ms})
        self._world.tell_now()

    def _emergency(self, _: str, line: Line, said: Said) -> None:
        self._hands.stop(self._world.field.robots)
        self._hands.press_emergency(self._world.robot.device.id_tag)
        said(True, f"{self._world.robot.device.label} has stopped")

    def _register(self, _: str, line: Line, said: Said) -> None:
        dva = str(line.get("dva", "")).strip()
        check_address(dva)
        self._world.station.register(dva, said)

    def _listen(self, _: str, line: Line, said: Said) -> None:
        self._world.station.listen()
        said(True, f"listens on {self._world.robot.device.address}")

    def _off(self, _: str, line: Line, said: Said) -> None:
        self._world.station.switch_off()
        said(True, "it is off")
