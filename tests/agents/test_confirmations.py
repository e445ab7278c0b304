"""A robot asks its DVA who may act on it, and hears the answer, or does not."""

import pytest
from helpers.dva.scripted_dva import OPERATOR, ROBOT, PretendedDva

from dva_sim.agents.robot.command_queue import Letter
from dva_sim.agents.robot.confirmations import Confirmations
from dva_sim.agents.robot.controller import INQUIRY_WAIT_S, Decision, Limits, RobotController
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


def test_an_answer_settles_nothing_that_arrived_after_its_question():
    """The DVA may have given the robot to the sender since; its next answer counts."""
    dva, concluded = PretendedDva(robots=1), list[tuple[Letter, int]]()
    controller = RobotController(ROBOT, dva.device.id_tag, Limits(watchdog=3.0, max_age=6.0))
    answers = list[m.Reply]()

    def decide(reply: m.Reply) -> Decision:
        answers.append(reply)
        controller.inquiry.answered(reply)
        return Decision(m.OK)

    confirmations = Confirmations(
        dva.field.robots[ROBOT].device,
        controller,
        decide,
        conclude=lambda letter: concluded.append((letter, len(answers))),
        happened=lambda _: None,
    )
    early, late = (Letter(name, dva.now) for name in (b"early", b"late"))
    for letter in (early, late):
        start = m.Message(ROBOT, 1, OPERATOR, "12:00:00", 1, m.StartTeleOp())
        assert confirmations.keep(letter, start)
        controller.inquiry.about_holder(OPERATOR)
        confirmations.ask()
    dva.run_for(INQUIRY_WAIT_S / 2)
    assert concluded == [(early, 1), (late, 2)]
