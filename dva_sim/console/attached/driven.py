"""A system that runs elsewhere as one whose robots people drive; see `DrivenSystem`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.operator.attention import OperatorSetup
from dva_sim.agents.operator.handheld import Console
from dva_sim.agents.operator.strategies import Reach
from dva_sim.agents.robot.controller import Mode
from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.attached.lines import UNKNOWN_ROOM
from dva_sim.console.attached.system import AttachedSystem
from dva_sim.console.people.seating import Seating
from dva_sim.console.views.things import UNKNOWN_ROBOT
from dva_sim.core.registry import OPERATOR
from dva_sim.network.patterns import Pattern, load_pattern
from dva_sim.protocol import messages as m
from dva_sim.simulation.scenario import Scenario, command_timeout_s, phone_profile

REACH: Final = Reach(UNKNOWN_ROBOT["max_speed_mps"], UNKNOWN_ROBOT["max_turn_rate_radps"])


class DrivenAttached:
    """Robots that a DVA elsewhere lists, for people in seats.

    A robot is driven in sight or by its own picture; the age of a command is told by the tick of
    its status.

    Args:
        system: System to which the console is attached.
        author: Name of the person at a page.

    Attributes:
        free_seat: Callback for a page that sits nowhere any more.
        stoppers: Device and name of the person who stopped a robot from a page, by its id.
    """

    seeks_orders = False

    def __init__(self, system: AttachedSystem, author: Callable[[str], str]) -> None:
        self._system = system
        self._author = author
        self.clock = system.clock
        scenario = system.scenario
        self.own_pattern = scenario.pattern
        self.stale_s = scenario.robot.max_age_s
        self._patterns: dict[str, str] = {}
        self.free_seat: Callable[[str], object] = lambda _: None
        self.stoppers: dict[str, tuple[str, str]] = {}
        self.seating = Seating(self._make_seat, self._console(scenario), lambda _: None)

    def _console(self, scenario: Scenario) -> Console:
        command = scenario.command
        setup = OperatorSetup(
            pattern=self._pattern_for,
            window=command.window,
            heeds=command.heeds,
            rate_hz=command.rate_hz,
            timeout=command_timeout_s(scenario),
            attempts=command.attempts,
            guarded=False,
            topic=lambda _: None,
        )
        return Console(setup=setup, phone=phone_profile(scenario), reach=self.reach)

    def _pattern_for(self, robot: str) -> Pattern:
        return load_pattern(self.pattern_of(robot))()

    def _make_seat(self, number: int) -> AgentDevice:
        device = self._system.new_seat(number, OPERATOR)
        for robot in self.robots():
            if self.hears(robot):
                device.connect(robot)  # an emergency does not wait for a connection
        return device

    # --- see `DrivenSystem` ----------------------------------------------------------------

    @property
    def now_ms(self) -> int:
        """Time for pages [ms]."""
        return self._system.now_ms

    @property
    def emergency_device(self) -> AgentDevice:
        """The console's own control room."""
        return self._system.device

    def robots(self) -> list[str]:
        """Ids of the robots that the DVA lists."""
        return self._system.robots()

    def names_of(self, robot: str) -> set[object]:
        """What a line may call a robot."""
        return {robot, self.number_of(robot), self.label_of(robot)}

    def number_of(self, robot: str) -> int | None:
        """Number by which pages know a robot."""
        return self._system.numbers.get(robot)

    def label_of(self, device: str) -> str:
        """Label of a device."""
        return self._system.label_of(device)

    def mode_of(self, robot: str) -> str:
        """Mode that a robot has published last."""
        entry = self._system.state.devices.get(robot)
        status = None if entry is None else entry.status
        return status.mode if isinstance(status, m.RobotStatus) else ""

    def pattern_of(self, robot: str) -> str:
        """Name of the pattern by which a robot is driven from here."""
        return self._patterns.get(robot, self.own_pattern)

    def reach(self, robot: str) -> Reach:
        """Limits of a robot: those of which pages know, since no message tells them."""
        return REACH

    def place_of(self, position: m.Position) -> tuple[float, float, str | None]:
        """A position on the map [m], and its room."""
        x, y = self._system.frame.to_xy(position.latitude, position.longitude)
        site = self._system.site
        return x, y, UNKNOWN_ROOM if site is None else site.room_at(x, y)

    def hears(self, robot: str) -> bool:
        """False for a robot that was added by hand here."""
        return not self._system.is_fake(robot)

    def introduce(self, device: AgentDevice, robots: Sequence[str]) -> None:
        """The list of the DVA has told where robots are found."""

    def why_not(self) -> str:
        """Nothing runs here that could stand in the way."""
        return ""

    def note_held(self, robots: set[str]) -> None:
        """Pictures do not come through here."""

    def note_emergency(self, robots: Sequence[str], device: AgentDevice, client: str) -> None:
        """Note who stopped a robot; of several, the first counts."""
        for robot in robots:
            entry = self._system.state.devices[robot]
            if entry.emergency is None or entry.emergency[0].released is not None:
                self.stoppers[robot] = device.id_tag, self._author(client)

    def change_pattern(self, robot: str, name: str, on_result: OnResult) -> None:
        """Drive a robot by another pattern, unless it is driven."""
        label = self.label_of(robot)
        if self.mode_of(robot) == Mode.TELEOPERATION.value:
            on_result(False, f"{label} is driven: it has to be stopped first")
            return
        self._patterns[robot] = name
        self._system.recorder.tell(self.clock.now, label, f"is driven by {name} from here", "link")
        on_result(True, "")
