"""Machine limits of a robot: power, drive, wet floor."""

from typing import Any

import pytest
from helpers.paths import ROOT
from helpers.wording import counted

from dva_sim.agents.device import HEARTBEAT, STATUS
from dva_sim.agents.robot.controller import Mode
from dva_sim.agents.robot.robot import FRAME
from dva_sim.network.messaging import Request
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import simulate
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.simulation.measures import episodes

ROBOT = id_of("robot", 1)
DRIVE = """
from dva_sim.worlds.drives import Drive
class Broken(Drive):
    def accelerations(self, *given):
        raise ValueError("no motor here")
"""


def scenario(changes: dict[str, Any] | None = None) -> scenarios.Scenario:
    return scenarios.build(scenarios.load("drive-to-event"), changes or {})


def asked(run: Run) -> list[m.Body]:
    """Sensors that a robot reports within half a second."""
    replies: list[m.Body] = []
    number = 900 + round(10 * run.clock.now)
    question = m.Message(DVA, number, ROBOT, "12:00:00", 0, m.GetSensorInfo())
    request = Request(encode(question), lambda data: replies.append(decode(data).body))
    run.field.robots[ROBOT].inbox.request(request)
    run.clock.run(run.clock.now + 0.5)
    return replies


def test_a_robot_without_power_neither_hears_nor_speaks_until_it_has_some_again():
    """0.08 % of 480 Wh is 1382 J: some 30 s of driving."""
    run = Run(scenario({"robot.charge": 0.0008}), seed=1)
    robot, heard = run.field.robots[ROBOT], list[float]()
    for topic in (HEARTBEAT, STATUS, FRAME):
        run.network.subscribe(DVA, ROBOT, topic, lambda _: heard.append(run.clock.now))
    run.clock.run(10.2)
    assert [type(body) for body in asked(run)] == [m.Reply]
    run.clock.run(59.6)
    off = next(line.time for line in run.recorder.timeline if "no power" in line.what)
    assert 15.0 < off < 50.0
    assert off - 0.5 < max(heard) < off + 0.1  # a frame was still under way
    assert asked(run) == []
    run.clock.run(60.2)
    robot.power(on=True)
    assert [type(body) for body in asked(run)] == [m.Reply]


@pytest.mark.parametrize(("robots", "ended"), [(1, "lost link"), (2, "confirmed")])
def test_who_stands_without_power_is_missed_and_another_one_is_sent(robots, ended):
    # Enough to get so far that who stands there blocks no door to the other.
    run = simulate(scenario({"robot.charge": 0.0013, "robot.count": robots}), 1)
    row = episodes.run_row(run)
    assert row["outcome"] == ended
    assert row["cause"] == ("battery" if robots == 1 else "")
    assert not run.recorder.violations
    assert {drive.robot for drive in run.recorder.drives} == {
        id_of("robot", number) for number in range(1, robots + 1)
    }


def test_a_drive_that_fails_is_told_once_and_counted_and_the_run_goes_on(tmp_path):
    (tmp_path / "broken.py").write_text(DRIVE)
    known = ROOT / "agents/robots/servrobot.yaml"
    profile = known.read_text().replace("differential", "broken.py:Broken")
    (tmp_path / "broken.yaml").write_text(profile)
    run = Run(scenario({"robot.profile": str(tmp_path / "broken.yaml")}), seed=1)
    run.clock.run(20.0)
    robot = run.field.robots[ROBOT]
    story = [line.what for line in run.recorder.timeline if "drive fails" in line.what]
    assert robot.controller.mode is Mode.TELEOPERATION
    assert len(story) == 1
    assert "ValueError: no motor" in story[0]
    assert counted(run.recorder.counters, "failed", "drive") > 100
    assert robot.body.distance == 0.0
