"""Operators when the DVA changes its mind.

The robots stand in their bay, in the middle of the building; the driver is the first person of the
population.
"""

import math

import numpy as np
import pytest
from helpers.dva.scripted_dva import EAST, OPERATOR, OTHER_ROBOT, ROBOT, WEST, PretendedDva
from helpers.wording import unnamed

from dva_sim.agents.operator.operator import OperatorAgent
from dva_sim.agents.robot.controller import Mode
from dva_sim.protocol import messages as m


@pytest.fixture
def dva() -> PretendedDva:
    return PretendedDva(robots=2)


@pytest.fixture
def operator(dva: PretendedDva) -> OperatorAgent:
    return dva.operator()


def is_driven(dva: PretendedDva, robot: str) -> bool:
    return dva.field.robots[robot].controller.mode is Mode.TELEOPERATION


def outcomes(dva: PretendedDva) -> list[str]:
    return [drive.outcome for drive in dva.stage.recorder.drives]


def test_the_same_order_again_is_answered_ok_and_changes_nothing(dva, operator):
    dva.start(1, EAST)
    for _ in range(3):
        assert dva.order(1, EAST, robot=ROBOT) == m.OK
        dva.run_for(2.0)
        assert is_driven(dva, ROBOT)
    assert dva.progress(1) == ["departed"]
    assert len(dva.stage.recorder.drives) == 1


def test_a_newer_order_for_the_same_robot_stops_it_and_drives_it_elsewhere(dva, operator):
    dva.start(1, EAST)
    assert dva.order(2, WEST, robot=ROBOT) == m.OK
    dva.run_for(0.5)
    assert not is_driven(dva, ROBOT)
    dva.run_until(lambda: "done" in dva.progress(2))
    assert dva.progress(1) == ["departed"]
    assert dva.progress(2) == ["departed", "arrived", "refuted", "done"]
    pose = dva.field.robots[ROBOT].body.pose()
    assert math.dist(pose[:2], WEST) < 2.0
    assert outcomes(dva) == ["redirected", "refuted"]


def test_the_next_drive_begins_when_the_robot_certainly_stands(dva, operator):
    dva.start(1, EAST)
    now = dva.now
    dva.order(2, WEST, robot=ROBOT)
    dva.run_until(lambda: len(dva.stage.recorder.drives) == 2)
    before, after = dva.stage.recorder.drives
    assert before.ended == after.ordered == pytest.approx(now, abs=0.05)
    assert dva.now - now >= 1.5
    assert abs(dva.field.robots[ROBOT].body.speed) < 0.01


def test_who_drives_the_same_robot_on_keeps_its_permission(dva, operator):
    dva.start(1, EAST)
    dva.order(2, WEST, robot=ROBOT)
    dva.run_until(lambda: "departed" in dva.progress(2))
    assert not any(isinstance(entry.body, m.PermissionRevocation) for entry in dva.received)
    assert dva.sessions[ROBOT].session == 1


def test_a_newer_order_for_another_robot_stops_the_first_and_gives_it_back(dva, operator):
    dva.start(1, EAST)
    assert dva.order(2, WEST, robot=OTHER_ROBOT) == m.OK
    dva.run_until(lambda: "departed" in dva.progress(2))
    assert not is_driven(dva, ROBOT)
    assert is_driven(dva, OTHER_ROBOT)
    assert dva.field.robots[ROBOT].controller.grant is None
    assert list(dva.sessions) == [OTHER_ROBOT]
    assert dva.progress(1) == ["departed"]


def test_no_robot_drives_on_if_the_newer_order_comes_while_it_starts():
    """At whatever moment: while the order is read, the permission asked for, or the start."""
    dva = PretendedDva(robots=2)
    dva.operator()
    ordered = dva.now
    dva.order(1, EAST, robot=ROBOT)
    dva.run_until(lambda: "departed" in dva.progress(1))
    took = dva.when(1, "departed") - ordered
    states = set()
    for early in np.arange(0.0, 0.2, 0.008):
        dva = PretendedDva(robots=2)
        operator = dva.operator()
        dva.order(1, EAST, robot=ROBOT)
        dva.run_for(ordered + took + 0.01 - early - dva.now)
        drive = operator.works[ROBOT]
        states.add((drive.session > 0, drive.log.started is not None))
        dva.order(2, WEST, robot=OTHER_ROBOT)
        dva.run_until(lambda dva=dva: "departed" in dva.progress(2))
        dva.run_for(1.0)
        assert not is_driven(dva, ROBOT)
        assert list(dva.sessions) == [OTHER_ROBOT]
    assert states == {(False, False), (True, False), (True, True)}


def test_of_three_orders_at_once_the_last_one_is_carried_out(dva, operator):
    dva.start(1, EAST)
    for event, robot in ((2, OTHER_ROBOT), (3, ROBOT), (4, OTHER_ROBOT)):
        assert dva.order(event, WEST, robot=robot) == m.OK
    dva.run_until(lambda: "done" in dva.progress(4))
    assert dva.progress(2) == dva.progress(3) == []
    assert not is_driven(dva, ROBOT)
    assert operator.activity == "waiting"


def test_an_order_that_the_dva_calls_over_ends_with_the_robot_at_rest(dva, operator):
    dva.start(1, EAST)
    assert dva.say(OPERATOR, m.OrderProgress(2, "done")) == m.OK
    assert is_driven(dva, ROBOT)
    assert dva.say(OPERATOR, m.OrderProgress(1, "done")) == m.OK
    dva.run_for(2.0)
    assert not is_driven(dva, ROBOT)
    assert dva.progress(1) == ["departed"]
    assert dva.sessions == {}
    dva.start(1, EAST)  # it may be given again
    assert outcomes(dva) == ["recalled", "timeout"]


def test_an_operator_who_leaves_forgets_what_was_next(dva, operator):
    dva.start(1, EAST)
    dva.order(2, WEST, robot=OTHER_ROBOT)
    operator.put_down()
    dva.run_for(60.0)
    assert dva.progress(2) == []
    assert not is_driven(dva, ROBOT)


def test_a_robot_can_look_and_nothing_else(dva, operator):
    for task in ("contain", "stand_by"):
        assert dva.order(1, EAST, task, ROBOT) == m.NOT_SUPPORTED
    assert dva.say(OPERATOR, m.Order(1, "fire", dva.position(EAST), None)) == m.NOT_SUPPORTED


# --- robots in auctions ----------------------------------------------------------------


def test_an_idle_robot_bids_4_s_and_its_way_at_35_centimetres_a_second(dva):
    dva.run_for(2.0)
    pose = dva.field.robots[ROBOT].body.pose()
    way = dva.stage.planner.distance((pose.x, pose.y), EAST)
    assert dva.announce(7, EAST, to=ROBOT) == m.OK
    [bid] = dva.bids()
    assert (bid.event_id, bid.arrival_in) == (7, pytest.approx(4.0 + way / 0.35))


def test_an_award_to_an_idle_robot_is_acknowledged_and_moves_nothing(dva):
    dva.run_for(2.0)
    dva.announce(7, EAST, to=ROBOT)
    assert dva.say(ROBOT, m.TaskAward(7)) == m.OK
    dva.run_for(30.0)
    assert dva.field.robots[ROBOT].controller.free


def test_a_robot_that_somebody_holds_does_not_bid_and_takes_no_award(dva, operator):
    dva.start(1, EAST)
    assert dva.announce(7, WEST, to=ROBOT) == m.OK
    assert dva.bids() == []
    assert dva.say(ROBOT, m.TaskAward(7)) == m.BUSY


def test_a_robot_hears_of_auctions_from_the_dva_alone(dva):
    stranger, codes = dva.stage.device("operator", 2), []
    for body in (m.TaskAnnouncement(7, "fire", dva.position(EAST), 0.5, 2.0), m.TaskAward(7)):
        stranger.ask(ROBOT, body, lambda reply: codes.append(reply.code))
    dva.run_for(1.0)
    assert codes == [m.NOT_PERMITTED] * 2
    assert dva.bids() == []


# --- asked to give a robot up --------------------------------------------------------------


def test_who_drives_a_robot_keeps_it_and_says_so(dva, operator):
    dva.start(1, EAST)
    assert dva.say(OPERATOR, m.HandoverRequest(ROBOT, OPERATOR, "control room")) == m.BUSY
    assert is_driven(dva, ROBOT)
    story = [moment.what for moment in dva.stage.recorder.timeline if moment.kind == "order"]
    assert unnamed(story[-1], "robot-1", "control room") == []


def test_who_does_not_drive_it_yet_gives_it_up(dva, operator):
    assert dva.say(OPERATOR, m.HandoverRequest(ROBOT, OPERATOR, "control room")) == m.OK
    assert dva.order(1, EAST, robot=ROBOT) == m.OK
    assert dva.say(OPERATOR, m.HandoverRequest(ROBOT, OPERATOR, "control room")) == m.OK
    assert dva.say(OPERATOR, m.OrderProgress(1, "done")) == m.OK  # as the DVA says then
    dva.run_for(60.0)
    assert not is_driven(dva, ROBOT)
