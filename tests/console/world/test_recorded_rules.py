"""A console's recording is judged as the console itself was, whatever people do to its robots."""

from pathlib import Path
from typing import Any

import pytest
from helpers.console.recorded_console import RecordedPage
from helpers.console.simulated_phone import PhonePage

from dva_sim.agents.robot.controller import Decision, RobotController
from dva_sim.protocol import messages as m
from dva_sim.recordings.reading import read_recording
from dva_sim.simulation.full.stage import id_of
from dva_sim.simulation.full.verdicts import RULES, verdicts
from dva_sim.testing.evidence import judged_recording

pytestmark = pytest.mark.system

ROBOT = id_of("robot", 1)


class Recorded:
    """A console's world in virtual time that keeps a recording."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, path: Path) -> None:
        self.page = PhonePage(monkeypatch, client="a1", bystander__count=0)
        self.world, self._path = self.page.world, path
        self._recorded = RecordedPage(self.page, path)

    def ask(self, after: float, body: m.Body, session: int = 5) -> None:
        """Let the DVA ask the first robot for something."""
        run = self.world.run
        run.clock.call_after(after, lambda: run.dva.device.ask(ROBOT, body, session=session))

    def states(self) -> list[dict[str, str]]:
        """The verdicts at the console's end, and those on its recording."""
        self._recorded.finish()
        recorded = judged_recording(read_recording(self._path))
        both: list[Any] = [verdicts(self.world.recorder), recorded]
        return [{verdict.rule: verdict.state for verdict in some} for some in both]


def test_an_answer_that_is_lost_was_given_all_the_same(monkeypatch, tmp_path):
    """The robot obeys an emergency, nobody hears of it, and is driven on by a new order."""
    console = Recorded(monkeypatch, tmp_path / "run.mcap")
    faults = console.world.windows.by_id[ROBOT].faults
    page = console.page
    page.let(5.0)
    assert page.do("take", robots=[0])[0]
    page.let(1.0)
    faults.drop_replies(True)
    console.ask(0.1, m.Emergency(), session=0)
    page.let(0.5)
    faults.drop_replies(False)
    page.let(1.0)
    assert page.do("start")[0]
    page.want(0.2, 0.4)
    page.let(10.0)
    assert console.world.run.field.robots[ROBOT].applied > 50
    assert console.states() == [dict.fromkeys(RULES, "held")] * 2


@pytest.mark.parametrize("is_deaf", [False, True])
def test_hands_faults_and_a_dva_that_is_stopped_are_part_of_the_recording(
    monkeypatch, tmp_path, is_deaf
):
    """Driven by hand, stopped by its button, hung, slowed; then again, by a robot that is deaf."""
    if is_deaf:
        monkeypatch.setattr(RobotController, "stop", lambda *_: Decision(m.OK, "stopped"))
    console = Recorded(monkeypatch, tmp_path / "run.mcap")
    window, page, run = console.world.windows.by_id[ROBOT], console.page, console.world.run
    page.let(5.0)
    assert window.hand.take("somebody").code == m.OK
    for tenth in range(30):
        window.hand.drive("somebody", 0.3, 0.2)
        if tenth == 20:
            window.hand.press_emergency()
        page.let(0.1)
    window.hand.let_go("somebody")
    page.let(2.0)
    console.world.run.deafened(ROBOT, True)
    window.faults.freeze(True)
    console.ask(0.1, m.Emergency(), session=0)
    page.let(8.0)
    console.world.run.deafened(ROBOT, False)
    window.faults.freeze(False)
    run.slowed(0.3)
    run.dva.silence(True)
    page.let(40.0)
    run.dva.silence(False)
    page.let(5.0)
    own, recorded = console.states()
    assert own == recorded == dict.fromkeys(RULES, "held") | ({"S3": "broken"} if is_deaf else {})
