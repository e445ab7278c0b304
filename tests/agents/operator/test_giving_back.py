"""A permission that was granted by a request without an answer is given back in the end."""

from helpers.dva.scripted_dva import OPERATOR, ROBOT, PretendedDva

from dva_sim.agents.operator.steps import GIVE_BACK_AGAIN, give_back_unanswered


def test_a_robot_that_was_wanted_again_and_then_no_longer_is_given_back():
    dva, wanted = PretendedDva(robots=1), [False]
    operator = dva.stage.device("operator", 1)
    dva.run_for(2.0)
    give_back_unanswered(operator, ROBOT, "teleoperation", lambda: wanted[0])
    while ROBOT not in dva.sessions:
        dva.run_for(0.001)
    assert dva.sessions[ROBOT].holder == OPERATOR
    wanted[0] = True
    dva.run_for(3 * GIVE_BACK_AGAIN)
    assert ROBOT in dva.sessions
    wanted[0] = False
    dva.run_for(2 * GIVE_BACK_AGAIN)
    assert ROBOT not in dva.sessions
