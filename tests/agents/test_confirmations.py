"""A robot asks its DVA who may act on it, and hears the answer, or does not."""

import pytest
from helpers.dva.scripted_dva import OPERATOR, ROBOT, PretendedDva

from dva_sim.protocol import messages as m


@pytest.mark.invariant("S5")
def test_what_the_dva_says_to_a_robot_that_hangs_counts_for_nothing():
    """Its computer has heard no answer: it asks again when it works again."""
    dva = PretendedDva(robots=1)
    robot = dva.field.robots[ROBOT]
    dva.run_for(2.0)
    grant = dva.sessions[ROBOT] = m.PermissionGrant(OPERATOR, "teleoperation", 1)
    dva.device.ask(ROBOT, grant, session=1)
    while robot.controller.inquiry.asked is None:
        dva.run_for(0.001)
    robot.hang()
    dva.run_for(1.0)
    assert robot.controller.grant is None
    robot.device.silent = False
    dva.run_for(robot.device.attempts * robot.device.timeout + 1.0)
    assert robot.controller.grant is not None
    assert robot.controller.grant.session == grant.session
