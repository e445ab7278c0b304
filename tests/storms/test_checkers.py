"""The checkers of S8, S10 and S11: each has seen its fault."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from storms.test_storms import SMALL

from dva_sim.kernel.recorder import Recorder
from dva_sim.network.messaging import Request
from dva_sim.protocol import messages as m
from dva_sim.storms.answers import ANSWERED_WITHIN, AnswerWatch
from dva_sim.storms.bounds import MOST, oversized
from dva_sim.storms.interference import PassingMessage
from dva_sim.storms.plan import StormPlan
from dva_sim.storms.storm import Storm, play

ROBOT = "02:00:00:01:00:01"


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
        tap.serve(service, Request(b"<msg/>", lambda _: None, peer="somebody"))

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


@pytest.mark.parametrize(("many", "found"), [(MOST, []), (MOST + 1, ["Hoard.kept[]"])])
def test_a_container_beyond_its_bound_is_found(many, found):
    assert [name for name, *_ in oversized([Hoard(many)])] == found


# --- S8: robots and a DVA that do not recover ------------------------------------------------


def unrecovered(spoil):
    """What has not recovered in a storm without faults, in which a test spoils something."""
    plan = replace(StormPlan(1, SMALL, (), 0.0), calm_s=60.0)
    outcome = play(plan, lambda storm: storm.run.clock.call_at(90.0, spoil, storm))
    return {(breach.rule, breach.who) for breach in outcome.breaches}


def silenced(storm: Storm):
    storm.robots[0].agent.device.silent = True


def refusing(storm: Storm):
    storm.robots[0].agent.refuses = m.BUSY


def away(storm: Storm):
    storm.dva.kill(1e4)


def test_what_works_has_recovered():
    assert unrecovered(lambda storm: None) == set()


@pytest.mark.parametrize(
    ("spoil", "who"), [(silenced, "robot-1"), (refusing, "robot-1"), (away, "dva")]
)
def test_what_does_not_work_has_not_recovered(spoil, who):
    assert ("S8", who) in unrecovered(spoil)
