"""A permission that is needed no longer is given back in the end, whatever is answered."""

import pytest
from helpers.dva.scripted_dva import OPERATOR, ROBOT, PretendedDva

from dva_sim.agents.operator.steps import (
    GIVE_BACK_AGAIN,
    GIVE_BACK_TRIES,
    give_back,
    give_back_unanswered,
)
from dva_sim.kernel.clock import Clock
from dva_sim.protocol import messages as m


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


class Answered:
    """A device whose DVA answers with these codes, one after the other; None: not at all."""

    id_tag, dva = OPERATOR, "02:00:00:00:00:01"

    def __init__(self, *codes):
        self.clock, self.codes, self.asked = Clock(), list(codes), []

    def ask(self, to, body, answered, unanswered):
        self.asked.append((to, body))
        code = self.codes.pop(0)
        if code is None:
            unanswered()
        else:
            answered(m.Reply(1, code, ""))


@pytest.mark.parametrize(
    ("codes", "times"),
    [
        ([m.OK], 1),
        ([m.BUSY, None, m.OK], 3),
        ([m.BAD_SESSION, m.OK], 2),
        ([m.BAD_SESSION] * 9, GIVE_BACK_TRIES),
        ([m.NOT_PERMITTED], 1),
    ],
)
def test_it_is_said_again_until_it_is_kept(codes, times):
    device = Answered(*codes)
    give_back(device, ROBOT, 7)
    device.clock.run(60.0)
    assert len(device.asked) == times
    assert set(device.asked) == {(device.dva, m.PermissionRevocation(ROBOT, OPERATOR, 7))}
