"""An operator who supervises: sends a robot to look, watches what it shows, and judges."""

import math

import pytest
from helpers.dva.scripted_dva import EAST, OPERATOR, OTHER_ROBOT, ROBOT, WEST, PretendedDva

from dva_sim.agents.operator.operator import OperatorAgent
from dva_sim.agents.robot.controller import Mode
from dva_sim.protocol import messages as m


@pytest.fixture
def dva() -> PretendedDva:
    return PretendedDva(robots=2, control="supervisory")


@pytest.fixture
def operator(dva: PretendedDva) -> OperatorAgent:
    return dva.operator()


def fire(dva: PretendedDva) -> tuple[float, float]:
    """True position of the fire."""
    return dva.field.incidents[0].hazard.position


def mode(dva: PretendedDva, robot: str = ROBOT) -> Mode:
    return dva.field.robots[robot].controller.mode


def test_a_fire_that_the_robot_shows_is_confirmed(dva, operator):
    dva.start(1, fire(dva))
    assert operator.activity == "watches robot-1"
    dva.run_until(lambda: "done" in dva.progress(1))
    assert dva.progress(1) == ["departed", "arrived", "confirmed", "done"]
    dva.run_for(3.0)
    robot = dva.field.robots[ROBOT]
    assert mode(dva) is Mode.IDLE
    assert math.dist(robot.body.pose()[:2], fire(dva)) < 6.5
    assert robot.body.contacts == 0
    assert operator.activity == "waiting"


def test_it_takes_the_permission_for_missions_and_drives_nothing(dva, operator):
    dva.start(1, fire(dva))
    asked = [t.body for t in dva.received if isinstance(t.body, m.PermissionRequest)]
    assert [wish.level for wish in asked] == ["missions"]
    (log,) = dva.stage.recorder.drives
    assert log.sent == 0
    assert log.started is not None
    assert dva.field.robots[ROBOT].applied == 0


def test_where_nothing_is_it_says_so_after_having_looked_around(dva, operator):
    dva.start(1, EAST)
    dva.run_until(lambda: "done" in dva.progress(1))
    assert dva.progress(1) == ["departed", "arrived", "refuted", "done"]
    looked = dva.when(1, "refuted") - dva.when(1, "arrived")
    assert looked == pytest.approx(operator._seat.person.search, abs=1.0)
    assert dva.stage.recorder.drives[0].outcome == "refuted"


def test_a_recall_stops_the_robot_and_gives_it_back(dva, operator):
    dva.start(1, EAST)
    assert dva.say(OPERATOR, m.OrderProgress(1, "done")) == m.OK
    dva.run_for(3.0)
    robot = dva.field.robots[ROBOT]
    assert mode(dva) is Mode.IDLE
    assert robot.controller.mission_status.reason == "cancelled"
    assert robot.controller.grant is None
    assert abs(robot.body.speed) < 0.01
    assert dva.stage.recorder.drives[0].outcome == "recalled"


def test_a_newer_order_sends_the_same_robot_elsewhere(dva, operator):
    dva.start(1, EAST)
    assert dva.order(2, WEST, robot=ROBOT) == m.OK
    dva.run_until(lambda: "done" in dva.progress(2))
    assert dva.progress(1) == ["departed"]
    assert dva.progress(2) == ["departed", "arrived", "refuted", "done"]
    assert math.dist(dva.field.robots[ROBOT].body.pose()[:2], WEST) < 2.0


def test_a_newer_order_for_another_robot_stops_the_first(dva, operator):
    dva.start(1, EAST)
    dva.order(2, WEST, robot=OTHER_ROBOT)
    dva.run_until(lambda: "departed" in dva.progress(2))
    assert mode(dva, ROBOT) is Mode.IDLE
    assert mode(dva, OTHER_ROBOT) is Mode.MISSION
    assert list(dva.sessions) == [OTHER_ROBOT]


def test_a_robot_that_gives_up_makes_its_operator_give_up(dva, operator):
    dva.start(1, EAST)
    dva.say(ROBOT, m.Emergency())
    dva.run_until(lambda: "failed" in dva.progress(1), limit=30.0)
    assert dva.progress(1) == ["departed", "failed"]
    assert dva.stage.recorder.drives[0].outcome == "gave up"
    assert any("the robot: emergency" in moment.what for moment in dva.stage.recorder.timeline)


def test_a_place_without_a_way_is_given_up(dva, operator):
    dva.order(1, (200.0, 200.0), robot=ROBOT)
    dva.run_until(lambda: "failed" in dva.progress(1), limit=60.0)
    assert any("no way" in moment.what for moment in dva.stage.recorder.timeline)


def test_the_same_person_judges_the_same_fire_under_each_control():
    """Order, picture, judgement and report are one thing; only who steers differs."""
    for control in ("direct", "coordinated", "supervisory"):
        dva = PretendedDva(robots=1, control=control)
        dva.operator()
        dva.order(1, fire(dva), robot=ROBOT)
        dva.run_until(lambda dva=dva: "done" in dva.progress(1))
        assert dva.progress(1) == ["departed", "arrived", "confirmed", "done"]
        assert dva.stage.recorder.violations == {}
