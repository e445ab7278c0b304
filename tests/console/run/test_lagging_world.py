"""Real-time world on a machine that cannot keep up: robots stop, and the page says why."""

import time

import pytest
from helpers.console.declared_lines import checked
from helpers.processes.patience import becomes

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.world.run_actions import RunActions
from dva_sim.console.world.world import ConsoleWorld
from dva_sim.network.realtime import Poller
from dva_sim.simulation.scenario import build, load

pytestmark = pytest.mark.system


@pytest.fixture
def world():
    made = ConsoleWorld(build(load("hands-on")), "hands-on", 1)
    made.lines = []
    made.tell = lambda line, key="": made.lines.append(checked(line))
    made.actions = RunActions(made)
    made.begin()
    made.clock.go()
    return made


def lets_time_pass(world, until):
    """Run the world until something becomes true; False if it does not."""

    def look():
        world.clock.run(world.clock.now + 0.05)
        return until()

    return becomes(look)


def answer(world, **action):
    world.actions.take({"client": "c1", **action})
    number = action["id"]

    def find():
        return [x for x in world.lines if x["k"] == "done" and x["id"] == number]

    assert lets_time_pass(world, find)
    return find()[0]["ok"]


def test_a_slow_callback_stops_who_is_driven_and_nothing_begins_again_by_itself(world):
    robot = next(iter(world.run.field.robots.values()))
    assert answer(world, id="take", do="take", robots=[0])
    starts = iter(range(1000))
    assert lets_time_pass(world, lambda: answer(world, id=f"start{next(starts)}", do="start"))
    world.lines.clear()
    world.clock.call_after(0.1, time.sleep, 0.6)
    assert lets_time_pass(world, lambda: robot.controller.mode is Mode.IDLE)
    reported = lambda: any("behind real" in line.get("what", "") for line in world.lines)  # noqa: E731
    assert lets_time_pass(world, reported)
    assert lets_time_pass(world, lambda: not world.lag.held)
    world.clock.run(world.clock.now + 1.0)
    assert robot.controller.mode is Mode.IDLE


def test_halted_with_nobody_there_it_hardly_ever_wakes(world, monkeypatch):
    turns = []
    poll = Poller.poll

    def counted(poller, wait):
        turns.append(wait)
        return poll(poller, wait)

    monkeypatch.setattr(Poller, "poll", counted)
    world.clock.pace(paused=True)
    end = time.monotonic() + 2.0
    world.clock.pulse(0.1, lambda: world.clock.stop() if time.monotonic() > end else None)
    world.clock.run()
    assert len(turns) < 200  # some 80 are due in these two seconds; a busy loop makes thousands
