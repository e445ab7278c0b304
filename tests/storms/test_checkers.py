"""The checkers of S8, S10 and S11: each has seen its fault."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from helpers.dva.permissions import enter
from storms.test_storms import SMALL

from dva_sim.core.handovers import STOP_WITHIN
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.messaging import Request
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode
from dva_sim.simulation.full.observations import Right
from dva_sim.simulation.full.stage import DVA
from dva_sim.simulation.full.takeovers import Takeovers
from dva_sim.storms.checkers import (
    ANSWERED_WITHIN,
    MAX_BREACHES,
    AnswerWatch,
    RefusedDrivers,
    oversized,
)
from dva_sim.storms.interference import PassingMessage
from dva_sim.storms.plan import StormPlan
from dva_sim.storms.storm import Storm, play

ROBOT, DRIVER, OTHER = "02:00:00:01:00:01", "02:00:00:03:00:01", "02:00:00:03:00:02"
MESSAGE = encode(m.Message(ROBOT, 1, DRIVER, "12:00:00", 1, m.GetMissionStatus()))


class Asked:
    """Answers of one robot, whose time and service a test decides."""

    def __init__(self):
        self.now, self.recorder = 0.0, Recorder(False)
        self.answers = AnswerWatch(
            self.recorder, lambda: self.now, {ROBOT: "robot-1"}, lambda *_: None
        )

    def ask(self, service):
        """The robot gets a request, and its service does something with it."""
        tap = self.answers.tap(ROBOT)

        def take(data):
            tap.serve(service, Request(data, lambda _: None, peer="somebody"))

        self.answers.watch(PassingMessage("somebody", ROBOT, MESSAGE, take))

    def after(self, seconds):
        """The rules that are broken when some time has passed."""
        self.now += seconds
        self.answers.look()
        return set(self.recorder.violations)


def count(asked, what="refused: busy"):
    asked.recorder.counters[what] += 1


def test_a_request_that_is_neither_answered_nor_counted_breaks_s11():
    asked = Asked()
    asked.ask(lambda request: None)
    assert asked.after(ANSWERED_WITHIN - 1) == set()
    assert asked.after(2) == {"S11"}


def test_a_request_that_is_answered_late_or_counted_breaks_nothing():
    asked, kept = Asked(), []
    asked.ask(kept.append)
    asked.ask(lambda request: count(asked))
    kept[0].answer(b"")
    assert asked.after(ANSWERED_WITHIN + 1) == set()


def test_a_younger_request_does_not_use_up_the_count_of_one_that_waits():
    asked, waits = Asked(), [True]
    asked.answers._waits = lambda node, data: waits[0]
    asked.ask(lambda request: count(asked))
    asked.now += ANSWERED_WITHIN / 2
    asked.ask(lambda request: count(asked))
    assert asked.after(ANSWERED_WITHIN / 2 + 1) == set()  # the first was sent again, and waits
    waits[0] = False
    for _ in range(2):
        assert asked.after(ANSWERED_WITHIN) == set()


def test_one_count_excuses_one_request():
    asked = Asked()
    asked.ask(lambda request: None)
    asked.ask(lambda request: count(asked))
    assert asked.after(ANSWERED_WITHIN + 1) == {"S11"}


def test_nothing_is_expected_of_a_robot_that_is_down():
    asked = Asked()
    asked.ask(lambda request: None)
    asked.answers.excuse(ROBOT, excused=True)
    asked.ask(lambda request: None)
    assert asked.after(ANSWERED_WITHIN + 1) == set()


def test_a_refusal_that_is_answered_excuses_nothing():
    asked = Asked()
    asked.ask(lambda request: None)

    def refuse(request):
        count(asked)
        request.answer(b"")

    asked.ask(refuse)
    assert asked.after(ANSWERED_WITHIN + 1) == {"S11"}


@pytest.mark.parametrize(("counted", "broken"), [(True, set()), (False, {"S11"})])
def test_what_is_no_message_has_to_be_counted_or_answered(counted, broken):
    asked = Asked()
    take = (lambda _: count(asked)) if counted else (lambda _: None)
    asked.answers.watch(PassingMessage("x", ROBOT, b"<no message", take))
    assert set(asked.recorder.violations) == broken


class Hoard:
    """Something that keeps too much, two steps below where one begins to look."""

    def __init__(self, many):
        self.inner = SimpleNamespace()
        self.kept = [list(range(many))]


Hoard.__module__ = "dva_sim.made_up"


@pytest.mark.parametrize(
    ("many", "found"), [(MAX_BREACHES, []), (MAX_BREACHES + 1, ["Hoard.kept[]"])]
)
def test_a_container_beyond_its_bound_is_found(many, found):
    assert [name for name, *_ in oversized([Hoard(many)])] == found


# --- S2 and S5: robots that change hands, drivers who go on --------------------------------------


def asked_for(takeover):
    return m.Message(DVA, 7, OTHER, "12:00:00", 0, m.PermissionRequest(ROBOT, "both", (), takeover))


@pytest.mark.parametrize(
    ("takeover", "after", "found"),
    [("force", 5.0, [(OTHER, 1)]), ("force", STOP_WITHIN + 1, []), ("ask", 5.0, [])],
)
def test_a_robot_that_was_stopped_for_somebody_is_noticed_when_it_is_given(takeover, after, found):
    watch = Takeovers()
    assert list(watch.given([Right(ROBOT, DRIVER, 1)], 0.0, True)) == []
    watch.hears(OTHER, asked_for(takeover))
    watch.says(OTHER, m.Reply(7, m.BUSY, ""), 1.0)
    assert list(watch.given([], 2.0, True)) == []
    given = list(watch.given([Right(ROBOT, OTHER, 2)], after, True))
    assert [(right.holder, session) for right, session in given] == found


@pytest.mark.parametrize(
    ("refusals", "after", "again", "broken"),
    [
        (3, 30.0, False, {"S5"}),
        (3, 10.0, False, set()),
        (2, 30.0, False, set()),
        (3, 30.0, 1, set()),
    ],
)
def test_a_driver_who_goes_on_though_it_is_refused_breaks_s5(refusals, after, again, broken):
    recorder = Recorder(False)
    watch = RefusedDrivers(recorder, {ROBOT: "robot-1", DRIVER: "operator-1"}, {DRIVER})
    no = encode(m.Message(DRIVER, 1, ROBOT, "12:00:00", 1, m.Reply(1, m.BAD_SESSION, "")))
    for second in range(refusals):
        watch.arrives(second, PassingMessage(ROBOT, DRIVER, no, None))
    if again:
        start = encode(m.Message(ROBOT, 8, DRIVER, "12:00:00", 2, m.StartTeleOp()))
        watch.sent(after - 1.0, DRIVER, ROBOT, start)
    command = encode(m.Message(ROBOT, 9, DRIVER, "12:00:00", 1, m.SetTeleOp(0.1, 0.0)))
    watch.sent(after, DRIVER, ROBOT, command)
    assert set(recorder.violations) == broken


# --- S8: robots and a DVA that do not recover ------------------------------------------------


def unrecovered(spoil):
    """Rules not recovered in a storm without faults, in which a test spoils something."""
    plan = replace(StormPlan(1, SMALL, (), 0.0), calm_s=60.0)
    outcome = play(plan, lambda storm: storm.run.clock.call_at(90.0, spoil, storm))
    return {(breach.rule, breach.who) for breach in outcome.breaches}


def silenced(storm: Storm):
    storm.robots[0].agent.device.silent = True


def refusing(storm: Storm):
    storm.robots[0].agent.refuses = m.BUSY


def unheard(storm: Storm):
    def leave():
        storm.run.dva._leave(storm.robots[0].id)
        return True

    storm.run.clock.every(1.0, leave)


def away(storm: Storm):
    storm.dva.kill(1e4)


def test_what_works_has_recovered():
    assert unrecovered(lambda storm: None) == set()


@pytest.mark.parametrize(
    ("spoil", "who"),
    [(silenced, "robot-1"), (refusing, "robot-1"), (unheard, "dva"), (away, "dva")],
)
def test_what_does_not_work_has_not_recovered(spoil, who):
    assert ("S8", who) in unrecovered(spoil)


def test_a_robot_that_its_holder_keeps_for_long_is_probed_as_long_as_any_other():
    """It is given back 5 s before the storm would end; its operator is silent, and no rival."""

    def keeps(storm: Storm):
        core, robot = storm.run.dva.core, storm.robots[0].id
        for device in storm.run.stage.devices:
            device.silent |= device.id_tag in storm.operators
        enter(core, robot, m.PermissionGrant(OTHER, "both", 1 << 33))
        given_back = storm.plan.horizon_s - 5.0
        storm.run.clock.call_at(given_back, core.sessions.permissions.end, 1 << 33)

    plan = replace(StormPlan(1, SMALL, (), 0.0), calm_s=60.0)
    outcome = play(plan, lambda storm: storm.run.clock.call_at(90.0, keeps, storm))
    assert ("S8", "robot-1") not in {(breach.rule, breach.who) for breach in outcome.breaches}
    assert outcome.simulated_s > plan.horizon_s
