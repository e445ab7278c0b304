"""Reports about a DVA that does not answer: it never did, or it is silent now."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from helpers.console.remote_console import RemotePage
from helpers.console.simulated_phone import PhonePage
from helpers.ros.bridged_robot import BridgedRobot
from helpers.ros.ros_machine import RosMachine

from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.simulation.scenario import build

WITHIN = 60.0  # somebody has tried in vain by then [s]


class Listener:
    """Somebody at a DVA, and what is said there of the DVA.

    Attributes:
        silence: Function that takes the DVA away.
        until: Function that lets time pass until something is so.
        story: Function that returns what was said.
    """

    def __init__(
        self,
        silence: Callable[[], object],
        until: Callable[[Callable[[], bool]], object],
        story: Callable[[], list[str]],
    ) -> None:
        self.silence, self.until, self.story = silence, until, story

    def says(self, word: str) -> list[str]:
        return [line for line in self.story() if word in line]


def simulated(absent: bool, _: Path, at_end: ExitStack) -> Listener:
    fire = {"kind": "fire", "at_s": 500.0, "room": "Workshop"}
    data = {"robot": {"count": 1}, "guard": {"count": 0}, "events": [fire]}
    run = Run(build(data, {}), seed=1)
    robot = id_of("robot", 1)

    def silence() -> None:
        run.network.leave(DVA)
        run.dva.silence(True)

    def until(true: Callable[[], bool]) -> None:
        while not true():
            assert run.clock.now < 20.0 + WITHIN
            run.clock.run(run.clock.now + 0.5)

    def story() -> list[str]:
        return [moment.what for moment in run.recorder.timeline if moment.who == "robot-1"]

    run.field.robots[robot].device.look_for_dva_at("10.0.0.1:5600")
    if absent:
        silence()
    else:
        run.clock.run(10.0)
    return Listener(silence, until, story)


def bridged(absent: bool, _: Path, at_end: ExitStack) -> Listener:
    machine = RosMachine()
    at_end.callback(machine.stop)
    robot = BridgedRobot(machine)
    at_end.callback(robot.close)
    robot.agent.device.look_for_dva_at("10.0.0.1:5600")
    if absent:
        robot.dva.leave(DVA)
    else:
        robot.ready()

    def silence() -> None:
        robot.dva.leave(DVA)
        robot.agent.device.ask(DVA, robot.agent.device._registration)

    return Listener(silence, robot.until, lambda: robot.story)


def attached(absent: bool, folder: Path, at_end: ExitStack) -> Listener:
    patches = at_end.enter_context(pytest.MonkeyPatch.context())
    world = PhonePage(patches, client="w1", bystander__count=0)

    def silence() -> None:
        world.world.run.network.leave(DVA)
        world.world.run.dva.silence(True)

    if absent:
        silence()
    page = RemotePage(world, folder / "audit.sqlite")
    at_end.callback(page.keeper.close)
    page.let(5.0)
    if not absent:
        page.lines.clear()

    def story() -> list[str]:
        hearing = [line["server"] for line in page.lines_of("rows")]
        words = {"never": "no DVA, never {}", "silent": "silent", "answers": ""}
        return [words[one["hearing"]].format(one["address"]) for one in hearing]

    return Listener(silence, page.until, story)


@pytest.fixture
def at_end() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


WHO = pytest.mark.parametrize("who", [simulated, bridged, attached])


@WHO
def test_a_dva_that_never_answered_is_called_that_and_nobody_is_said_to_obey_as_before(
    who, tmp_path, at_end
):
    listener = who(True, tmp_path, at_end)
    listener.until(lambda: bool(listener.says("never")))
    (line, *_) = listener.says("never")
    assert "no DVA" in line
    assert ":5600" in line or "198.51.100.1" in line
    assert listener.says("silent") == []
    assert listener.says("as before") == []


def test_a_robot_says_within_three_seconds_that_nobody_answers_where_it_was_told_to_look():
    run = Run(build({"robot": {"count": 1}, "guard": {"count": 0}}, {}), seed=1)
    run.field.robots[id_of("robot", 1)].device.look_for_dva_at("10.0.0.1:5600")
    run.network.leave(DVA)
    run.dva.silence(True)
    run.clock.run(3.0)
    said = [moment.what for moment in run.recorder.timeline if moment.who == "robot-1"]
    assert said == ["no DVA has answered at 10.0.0.1:5600 yet: it was never registered"]


@WHO
def test_a_dva_that_has_answered_is_silent_and_never_said_to_have_been_absent(
    who, tmp_path, at_end
):
    listener = who(False, tmp_path, at_end)
    listener.silence()
    listener.until(lambda: bool(listener.says("silent")))
    if who is not attached:
        assert listener.says("as before") == listener.says("silent")
    assert listener.says("never") == []
