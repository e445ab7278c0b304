"""One operator with two robots in hand: it watches both, or drives one after the other."""

import math
from itertools import pairwise

import pytest
from helpers.dva.scripted_dva import EAST, OPERATOR, OTHER_ROBOT, ROBOT, WEST, PretendedDva

from dva_sim.agents.operator.operator import OperatorAgent
from dva_sim.agents.robot.controller import Mode
from dva_sim.agents.robot.field_of_view import FieldOfView
from dva_sim.protocol import messages as m

SEARCH_S = 20.0  # of everybody, at a place where nothing is
THIRD_ROBOT = ROBOT[:-1] + "3"


def office(control: str, span: int = 2, robots: int = 2) -> tuple[PretendedDva, OperatorAgent]:
    """Small pictures: here all robots share one link."""
    changes = {"control": control, "operator.span": span, "camera.frame_bytes": 1000}
    dva = PretendedDva(robots, **changes, **{"operator.traits": {"search_s": SEARCH_S}})
    return dva, dva.operator()


def both_ordered(control: str) -> tuple[PretendedDva, OperatorAgent]:
    """An operator who has been sent with one robot to either side."""
    dva, operator = office(control)
    assert dva.order(1, EAST, robot=ROBOT) == dva.order(2, WEST, robot=OTHER_ROBOT) == m.OK
    return dva, operator


def modes(dva: PretendedDva) -> list[Mode]:
    return [robot.controller.mode for robot in dva.field.robots.values()]


def test_two_missions_run_at_the_same_time_and_both_are_judged():
    dva, operator = both_ordered("supervisory")
    dva.run_until(lambda: len(operator.works) == 2 and modes(dva) == [Mode.MISSION] * 2)
    assert operator.activity == "watches robot-1, watches robot-2"
    dva.run_until(lambda: "done" in dva.progress(1) and "done" in dva.progress(2))
    for event in (1, 2):
        assert dva.progress(event) == ["departed", "arrived", "refuted", "done"]
    dva.run_for(3.0)
    assert operator.activity == "waiting"
    assert modes(dva) == [Mode.IDLE] * 2
    assert dva.stage.recorder.violations == {}


def test_while_one_place_is_searched_the_other_robot_waits_for_the_eyes():
    dva, _ = both_ordered("supervisory")
    dva.run_until(lambda: "done" in dva.progress(1) and "done" in dva.progress(2))
    first, second = sorted(dva.when(event, "refuted") for event in (1, 2))
    assert second - first > 0.9 * SEARCH_S
    logs = dva.stage.recorder.drives
    spans = sorted(span for log in logs for span in log.attended)
    assert all(a[1] <= b[0] for a, b in pairwise(spans))
    assert sum(log.turned_to for log in logs) >= 2


def test_two_robots_driven_by_hand_go_one_after_the_other():
    dva, _ = both_ordered("direct")
    dva.run_until(lambda: "departed" in dva.progress(1))
    dva.run_for(5.0)
    assert modes(dva) == [Mode.TELEOPERATION, Mode.IDLE]
    dva.run_until(lambda: "departed" in dva.progress(2))
    assert dva.progress(1) == ["departed", "arrived", "refuted", "done"]
    assert modes(dva) == [Mode.IDLE, Mode.TELEOPERATION]
    first, second = dva.stage.recorder.drives
    assert first.ended is not None
    assert second.taken_up == pytest.approx(first.ended, abs=2.0)
    assert second.ordered < first.ended - 20.0


def test_a_third_robot_takes_the_place_of_the_one_ordered_longest_ago():
    dva, operator = office("supervisory", robots=3)
    for event, robot in ((1, ROBOT), (2, OTHER_ROBOT), (3, THIRD_ROBOT)):
        dva.order(event, EAST, robot=robot)
        dva.run_for(4.0)
    dva.run_for(5.0)
    assert modes(dva) == [Mode.IDLE, Mode.MISSION, Mode.MISSION]
    assert list(operator.works) == [OTHER_ROBOT, THIRD_ROBOT]
    assert sorted(dva.sessions) == [OTHER_ROBOT, THIRD_ROBOT]
    assert dva.stage.recorder.drives[0].outcome == "redirected"


def test_a_newer_order_for_a_robot_in_hand_leaves_the_other_alone():
    dva, operator = office("supervisory")
    dva.order(1, EAST, robot=ROBOT)
    dva.order(2, EAST, robot=OTHER_ROBOT)
    dva.run_until(lambda: len(operator.works) == 2 and modes(dva) == [Mode.MISSION] * 2)
    assert dva.order(3, WEST, robot=ROBOT) == m.OK
    dva.run_until(lambda: "departed" in dva.progress(3))
    assert operator.works[OTHER_ROBOT].order.event_id == 2
    assert operator.works[ROBOT].order.event_id == 3
    assert modes(dva) == [Mode.MISSION] * 2


def test_what_waits_for_its_turn_can_be_called_off():
    dva, operator = both_ordered("direct")
    assert dva.say(OPERATOR, m.OrderProgress(2, "done")) == m.OK
    dva.run_until(lambda: "done" in dva.progress(1))
    dva.run_for(10.0)
    assert dva.progress(2) == []
    assert operator.activity == "waiting"


def test_who_leaves_puts_both_robots_to_rest():
    dva, operator = both_ordered("supervisory")
    dva.run_until(lambda: modes(dva) == [Mode.MISSION] * 2)
    operator.put_down()
    dva.run_for(5.0)
    assert modes(dva) == [Mode.IDLE] * 2
    assert operator.works == {}


def test_a_revoked_permission_ends_one_mission_and_not_the_other():
    dva, operator = both_ordered("supervisory")
    dva.run_until(lambda: modes(dva) == [Mode.MISSION] * 2)
    over = m.PermissionRevocation(ROBOT, OPERATOR, dva.sessions[ROBOT].session)
    dva.say(ROBOT, over)
    dva.say(OPERATOR, over)
    dva.run_for(3.0)
    assert modes(dva) == [Mode.IDLE, Mode.MISSION]
    assert dva.field.robots[ROBOT].controller.mission_status.reason == "revoked"
    assert dva.stage.recorder.drives[0].outcome == "gave up"
    assert list(operator.works) == [OTHER_ROBOT]


# --- what is seen through smoke -------------------------------------------------------------


def fill_with_smoke(view: FieldOfView, extinction: float) -> None:
    """So much of it everywhere [1/m]."""
    object.__setattr__(view, "smoke", lambda a, b: extinction * math.dist(a, b))
    object.__setattr__(view, "hazy", lambda: True)


@pytest.mark.parametrize("control", ["direct", "supervisory"])
def test_a_robot_in_thick_smoke_never_refutes(control):
    """At the place, but through smoke of 20 /m one sees 15 cm."""
    dva = PretendedDva(robots=1, control=control)
    for robot in dva.field.robots.values():
        fill_with_smoke(robot._setup.view, 20.0)
    dva.operator()
    dva.order(1, EAST, robot=ROBOT)
    dva.run_until(lambda: "failed" in dva.progress(1))
    assert dva.progress(1) == ["departed", "arrived", "failed"]
    assert dva.stage.recorder.drives[0].outcome == "gave up"
    story = [moment.what for moment in dva.stage.recorder.timeline]
    assert any("nothing" in what for what in story)


def test_who_drives_through_thin_smoke_looks_from_nearer_and_can_refute():
    """Through smoke of 2.8 /m one sees 1.07 m: not from 1.2 m, but from 0.5 m."""
    dva = PretendedDva(robots=1)
    for robot in dva.field.robots.values():
        fill_with_smoke(robot._setup.view, 2.8)
    dva.operator()
    dva.order(1, EAST, robot=ROBOT)
    dva.run_until(lambda: "done" in dva.progress(1))
    assert dva.progress(1) == ["departed", "arrived", "refuted", "done"]
    assert math.dist(dva.field.robots[ROBOT].body.pose()[:2], EAST) < 1.07


def test_a_robot_is_given_back_whose_order_went_to_another_robot():
    """The DVA, after a restart, may give the same event to another robot: it takes that one back
    with the order, and knows nothing of the first."""
    dva, _ = office("direct")
    dva.start(1, EAST)
    assert dva.order(1, EAST, robot=OTHER_ROBOT) == m.OK
    dva.run_until(lambda: "done" in dva.progress(1))
    dva.run_for(3.0)
    assert ROBOT not in dva.sessions
