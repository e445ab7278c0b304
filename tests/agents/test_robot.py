"""Requests at a robot: which it admits, refuses and counts."""

import pytest
from helpers.dva.scripted_dva import OPERATOR, ROBOT, PretendedDva, driving

from dva_sim.agents.device import STATUS
from dva_sim.agents.robot.command_queue import PER_CONNECTION
from dva_sim.agents.robot.inquiry import BURST, RATE
from dva_sim.agents.robot.manual_control import ManualControl
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.network.messaging import Request
from dva_sim.network.patterns import load_pattern
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode

ASKED = "asked the DVA who holds a robot"
STRANGER = "02:00:00:09:00:09"


class Answers(list[m.Reply]):
    """Replies of a robot to somebody at its door."""

    def __init__(self, robot: RobotAgent) -> None:
        self._robot, self._number = robot, 0

    def ask(self, body: m.Body, source: str = STRANGER, session: int = 0) -> None:
        self._number += 1
        self.give(encode(m.Message(ROBOT, self._number, source, "12:00:00", session, body)))

    def give(self, data: bytes) -> None:
        request = Request(data, lambda reply: self.append(decode(reply).body), peer=STRANGER)
        self._robot.inbox.request(request)

    @property
    def codes(self) -> list[int]:
        return [reply.code for reply in self]


@pytest.fixture
def dva() -> PretendedDva:
    made = PretendedDva(robots=1)
    made.run_for(2.0)
    return made


@pytest.fixture
def robot(dva: PretendedDva) -> RobotAgent:
    return dva.field.robots[ROBOT]


@pytest.mark.invariant("S11")
def test_what_is_no_message_is_answered_and_stops_nothing(dva, robot):
    answers = Answers(robot)
    answers.give(b"<")
    answers.ask(m.GetSensorInfo())
    dva.run_for(1.0)
    assert answers.codes == [m.BAD_MESSAGE, m.OK]


@pytest.mark.invariant("S11")
def test_for_whom_there_is_no_room_is_told_so_at_once(dva, robot):
    answers = Answers(robot)
    for _ in range(PER_CONNECTION + 3):
        answers.ask(m.GetSensorInfo())
    dva.run_for(0.001)
    assert answers.codes == [m.BUSY, m.BUSY]  # one is worked on already
    dva.run_for(5.0)
    assert answers.codes[2:] == [m.OK] * (PER_CONNECTION + 1)


@pytest.mark.parametrize(
    ("doubt", "at_once"), [("none", True), ("a question", False), ("a word of the DVA", False)]
)
def test_while_somebody_drives_a_stranger_costs_time_only_if_it_may_be_the_next_holder(
    doubt, at_once
):
    dva, _ = driving("req-rep")
    robot = dva.field.robots[ROBOT]
    answers = Answers(robot)
    if doubt == "a question":
        robot.controller.inquiry.about_holder(STRANGER)
    elif doubt == "a word of the DVA":
        for _ in range(2):
            answers.ask(m.GetMissionStatus(), dva.device.id_tag)
    answers.ask(m.StartTeleOp())
    assert (answers.codes == [m.NOT_PERMITTED]) is at_once
    dva.run_for(10.0)
    assert answers.codes[-1] == m.NOT_PERMITTED


@pytest.mark.invariant("S5")
@pytest.mark.parametrize(("holder", "code"), [(OPERATOR, m.OK), (STRANGER, m.NOT_PERMITTED)])
def test_who_starts_before_the_robot_knows_of_the_permission_waits_for_the_dvas_word(
    dva, robot, holder, code
):
    dva.sessions[ROBOT] = m.PermissionGrant(holder, "teleoperation", 1)
    answers, before = Answers(robot), robot.device.recorder.counters[ASKED]
    answers.ask(m.StartTeleOp(), OPERATOR, session=1)
    dva.run_for(2.0)
    assert answers.codes == [code]
    assert robot.device.recorder.counters[ASKED] == before + 1


def test_the_motors_of_a_driven_robot_follow_the_set_point_of_its_driver():
    dva, _ = driving("req-rep")
    robot = dva.field.robots[ROBOT]
    assert robot.set_point.speed > 0.1
    assert robot.body.asked[:2] == pytest.approx(robot.set_point[:2])


def test_a_robot_that_cannot_be_driven_publishes_nothing_until_it_can_and_says_why(dva, robot):
    heard = list[bytes]()
    dva.network.subscribe(dva.device.id_tag, ROBOT, STATUS, heard.append)
    why = "its drive does not answer"
    robot.withdraw(why)
    dva.run_for(1.0)
    heard.clear()  # that it is idle
    answers = Answers(robot)
    dva.sessions[ROBOT] = m.PermissionGrant(OPERATOR, "teleoperation", 1)
    answers.ask(m.StartTeleOp(), OPERATOR, session=1)
    dva.run_for(5.0)
    assert [(reply.code, reply.text) for reply in answers] == [(m.BUSY, why)]
    assert heard == []
    robot.return_to_service()
    dva.run_for(3.0)
    assert heard


def test_a_hand_takes_a_robot_once_and_another_is_told_whose_it_is(dva, robot):
    codes = [ManualControl(robot).take(who).code for who in ("ana", "ana", "rui")]
    assert codes == [m.OK, m.OK, m.BUSY]


def test_the_timeline_says_when_a_hand_drives_a_robot_and_presses_its_button(dva, robot):
    hand, timeline = ManualControl(robot), robot.device.recorder.timeline
    begun, known = dva.now, len(timeline)
    for does in (lambda: hand.take("ana"), lambda: hand.let_go("ana"), hand.press_emergency):
        does()
        dva.run_for(1.0)
    told = [(each.who, each.time - begun, each.what.split(",")[0]) for each in timeline[known:]]
    assert told == [
        ("robot-1", pytest.approx(0.0), "is driven by hand from now on"),
        ("robot-1", pytest.approx(1.0), "is no longer driven by hand"),
        ("robot-1", pytest.approx(2.0), "is stopped by its own emergency button"),
    ]


def test_what_is_refused_is_counted_with_its_reason(dva, robot):
    answers = Answers(robot)
    answers.ask(m.PermissionRevocation(ROBOT, OPERATOR, 1))
    answers.ask(m.GetSensorInfo())
    dva.run_for(2.0)
    assert (answers.codes, robot.refused) == ([m.NOT_PERMITTED, m.OK], 1)


@pytest.mark.invariant("S10")
def test_claims_beyond_the_burst_are_asked_about_later_and_none_is_forgotten(dva, robot):
    claims, counters = int(BURST) + 3, robot.device.recorder.counters
    before = counters[ASKED]
    for _ in range(claims):
        robot.controller.inquiry.about_holder(OPERATOR)
        robot._confirmations.ask()
        dva.run_for(0.05)
    assert robot.controller.inquiry.is_open
    dva.run_for(claims / RATE + 1.0)
    assert BURST < counters[ASKED] - before <= claims
    assert not robot.controller.inquiry.is_open


@pytest.mark.parametrize(("conflate", "conflates"), [("none", False), ("both", True)])
@pytest.mark.parametrize(("name", "newest_wins"), [("latest-wins", True), ("req-rep", False)])
def test_only_the_newest_command_waits_where_a_pattern_or_a_robot_keeps_no_other(
    name, newest_wins, conflate, conflates
):
    dva = PretendedDva(robots=1, **{"zeromq.conflate": conflate})
    robot = dva.field.robots[ROBOT]
    robot.expect(load_pattern(name)())
    assert robot.inbox.latest_wins is (newest_wins or conflates)
