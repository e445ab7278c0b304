"""Any robot that a console lists is driven from its page, of any origin: one story, all ways."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.console.foreign_device import LABEL, foreign_device
from helpers.console.remote_console import RemotePage
from helpers.console.simulated_phone import PhonePage
from helpers.wording import unnamed

from dva_sim.agents.device import STATUS
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.run import Run


class ForeignRobot:
    """A robot of another make: it answers OK to everybody, and notes the requests.

    Args:
        run: Run of the DVA at which it registers.
    """

    label = LABEL

    def __init__(self, run: Run) -> None:
        ours = run.dva.device
        self.commands: list[m.SetTeleOp] = []
        self.heard: list[type] = []
        self._here = m.Position(*ours.frame.to_latlon(1.0, 1.0))
        self._mode = "Idle"
        self._device = foreign_device(run)
        self._device.serve(self._answer)
        self._device.register()
        run.clock.every(1.0, self._tell)

    def _tell(self) -> None:
        tick = round(1000 * self._device.clock.now)
        self._device.publish(STATUS, m.RobotStatus(self._mode, self._here, 0.0, 0.0, 0.0, tick))

    def _answer(self, message: m.Message) -> m.Reply:
        self.heard.append(type(message.body))
        if isinstance(message.body, m.StartTeleOp | m.StopTeleOp | m.Emergency):
            self._mode = "Teleoperation" if isinstance(message.body, m.StartTeleOp) else "Idle"
        if isinstance(message.body, m.SetTeleOp):
            self.commands.append(message.body)
        return m.Reply(message.message_id, m.OK, "")


class Desk:
    """A page of a console, and a hand on it that holds on.

    Args:
        do: Does an action and returns its answer: whether it was done, and the text.
        take: Takes a line without an answer.
        page: Page whose time goes by.
        lines: Lines that the page got.
    """

    def __init__(
        self,
        do: Callable[..., tuple[bool, str]],
        take: Callable[[dict[str, Any]], object],
        page: PhonePage,
        lines: list[dict[str, Any]],
    ) -> None:
        self.do = do
        self.page = page
        self._take = take
        self._lines = lines
        self._count = 0
        self.speed: float | None = None
        page.world.clock.every(0.05, self._hold)

    def _hold(self) -> None:
        if self.speed is not None:
            self._count += 1
            line = {"do": "input", "client": "c1", "role": "drive", "n": self._count}
            self._take(line | {"speed": self.speed, "turn": 0.0, "held": True})

    def seat(self) -> dict[str, Any]:
        """The newest line about the page's own seat."""
        mine = (one for one in reversed(self._lines) if one["k"] == "seat" and one["seat"] == "c1")
        return next(mine)

    def row(self, label: str) -> dict[str, Any]:
        """The newest row of a robot."""
        number = next(
            thing["i"]
            for line in reversed(self._lines)
            if line["k"] == "scene"
            for thing in line["things"]
            if thing["label"] == label
        )
        rows = next(line for line in reversed(self._lines) if line["k"] == "rows")["robots"]
        return next(row for row in rows if row["i"] == number)


def own_run(page: PhonePage, _: Path) -> Desk:
    """A console over its own run."""
    return Desk(page.do, page.actions.take, page, page.lines)


def attached(page: PhonePage, folder: Path) -> Desk:
    """A console that knows the same run by its messages alone."""
    other = RemotePage(page, folder / "audit.sqlite")
    other.actions.take({"do": "here", "pages": {"c1": "supervise"}})

    def do(what: str, **about: Any) -> tuple[bool, str]:
        answer = other.ask(what, **about)
        return answer["ok"], answer["text"]

    return Desk(do, other.actions.take, page, other.lines)


@pytest.fixture(params=[own_run, attached])
def desk(request: pytest.FixtureRequest, monkeypatch: Any, tmp_path: Path) -> Desk:
    page = PhonePage(monkeypatch, client="c1")
    foreign = ForeignRobot(page.world.run)
    made: Desk = request.param(page, tmp_path)
    made.foreign = foreign  # type: ignore[attr-defined]
    page.let(6.0)
    return made


def test_a_robot_of_the_run_is_driven(desk):
    assert desk.do("take", robots=["robot-1"])[0]
    assert desk.do("start")[0]
    desk.speed = 0.5
    desk.page.let(3.0)
    robot = desk.page.robot()
    assert robot.body.speed == pytest.approx(0.25, abs=0.03)
    shown = desk.seat()
    assert (shown["phase"], shown["drives"][0]["wanted"]) == ("driving", [0.25, 0.0])
    assert shown["label"] in desk.row("robot-1")["holder_label"]
    assert desk.do("stop")[0]
    desk.page.let(1.0)
    assert robot.body.speed == pytest.approx(0.0, abs=0.01)
    assert desk.do("release")[0]
    desk.page.let(2.0)
    assert robot.controller.grant is None


def test_a_robot_from_outside_is_driven_by_the_pattern_that_is_chosen(desk):
    assert desk.do("pattern", robot="theirs", name="req-rep")[0]
    assert desk.do("take", robots=["theirs"])[0]
    assert desk.do("start")[0]
    desk.speed = 0.5
    desk.page.let(3.0)
    commands = desk.foreign.commands
    assert len(commands) > 5
    assert commands[-1].speed == pytest.approx(0.25)
    assert commands[-1].seen_tick is not None
    assert desk.seat()["drives"][0]["pattern"] == "req-rep"
    assert unnamed(desk.do("start")[1], "theirs") == []
    assert desk.do("release")[0]
    desk.page.let(2.0)
    assert desk.foreign.heard[-1] is m.PermissionRevocation or m.StopTeleOp in desk.foreign.heard


def test_an_emergency_reaches_both_and_ends_the_drive(desk):
    assert desk.do("take", robots=["theirs"])[0]
    assert desk.do("start")[0]
    done, text = desk.do("emergency", robots="all")
    assert done
    assert unnamed(text, "robot-1", "theirs") == []
    assert m.Emergency in desk.foreign.heard
    assert desk.page.robot().controller.latch.holds
    desk.page.let(0.2)
    assert desk.seat()["phase"] == "held"


@pytest.mark.parametrize("what", [{"robots": ["nobody"]}, {"robots": [99]}])
def test_what_nobody_knows_is_refused_by_its_name(desk, what):
    done, text = desk.do("take", **what)
    assert not done
    assert repr(what["robots"][0]) in text


def test_a_page_that_is_hidden_or_gone_ends_its_drive(desk):
    assert desk.do("take", robots=["robot-1"])[0]
    assert desk.do("start")[0]
    desk.speed = 0.5
    desk.page.let(2.0)
    desk.speed = None
    desk._take({"do": "gone", "client": "c1", "role": "drive"})
    desk.page.let(2.0)
    assert desk.page.robot().body.speed == pytest.approx(0.0, abs=0.01)
    assert desk.seat()["phase"] == "held"
    assert desk.do("release")[0]


def test_a_page_that_falls_silent_while_it_holds_ends_its_drive(desk):
    assert desk.do("take", robots=["robot-1"])[0]
    assert desk.do("start")[0]
    desk.speed = 0.5
    desk.page.let(2.0)
    desk.speed = None
    desk.page.let(2.0)
    assert desk.page.robot().body.speed == pytest.approx(0.0, abs=0.01)
    assert unnamed(desk.seat()["alert"], "silent") == []
