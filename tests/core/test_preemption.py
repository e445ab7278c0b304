"""Preemption of responders under way, by rules that hold for any policy."""

from collections.abc import Sequence

import numpy as np
import pytest
from helpers.dva.dispatch_office import (
    GUARD,
    OPERATOR,
    OTHER_OPERATOR,
    ROBOT,
    Office,
    east,
)

from dva_sim.core.assignments import Rules
from dva_sim.core.dispatch import Advice, Assignment, Policy, Preemptive, Situation
from dva_sim.core.events import State
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m


class Grabbing(Policy):
    """Sends everybody to the newest event, busy or not."""

    preempts = True

    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        newest = len(situation.tasks) - 1
        return [Assignment(newest, r) for r in range(len(situation.responders))][:1]


@pytest.fixture
def office() -> Office:
    """A guard alone, on its way to a small fire 80 m off."""
    office = Office(Preemptive())
    office.busy(ROBOT, OPERATOR)
    office.ok(office.fire(80, severity=0.2, now=0.0))
    assert office.working[GUARD] == 1
    return office


def test_the_guard_is_redirected_and_the_first_event_waits_again(office):
    sends = office.fire(20, severity=0.9, now=5.0)
    assert sends == [Send(GUARD, m.Order(2, "fire", east(20), None))]
    assert (office.event(1).state, office.event(2).state) == (State.PENDING, State.ASSIGNED)
    assert office.core.counters["preempted"] == 1


def test_to_be_preempted_is_no_attempt_and_no_new_wait(office):
    assert office.event(1).attempts == 1
    office.fire(20, severity=0.9, now=5.0)
    event = office.event(1)
    assert (event.attempts, event.preemptions, event.waiting_since) == (0, 1, 0.0)
    assert set(event.times) == {"detected"}


def test_nobody_is_called_away_from_a_scene(office):
    office.progress(GUARD, "arrived", 4.0)
    assert office.fire(20, severity=0.9, now=5.0) == []
    assert office.event(1).state is State.ON_SCENE


def test_nobody_is_called_away_from_an_event_that_has_waited_for_60_s(office):
    assert office.fire(20, severity=0.9, now=60.0) == []
    assert office.event(1).state is State.ASSIGNED
    assert office.core.counters["overruled"] == 1


def test_who_has_not_taken_its_order_up_yet_is_not_redirected():
    office = Office(Preemptive())
    office.busy(ROBOT, OPERATOR)
    office.fire(80, severity=0.2)
    assert office.fire(20, severity=0.9, now=1.0) == []


def test_the_operator_stays_with_its_robot():
    office = Office(Preemptive())
    office.register(OTHER_OPERATOR, "TeleOp")
    office.busy(GUARD)
    office.ok(office.fire(80, severity=0.2))
    session = office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))[0]
    assert session.code == m.OK
    sends = office.fire(20, severity=0.9, now=5.0)
    assert sends == [Send(OPERATOR, m.Order(2, "fire", east(20), ROBOT))]
    assert office.event(2).operator == OPERATOR
    assert office.core.sessions.permissions.grants[ROBOT].holder == OPERATOR
    assert {n: e for n, e in office.working.items() if e != 99} == {OPERATOR: 2, ROBOT: 2}


def test_the_redirected_one_that_declines_leaves_both_events_open(office):
    sends = office.fire(20, severity=0.9, now=5.0)
    office.no(sends, 6.0)
    assert [office.event(n).state for n in (1, 2)] == [State.PENDING, State.PENDING]


def test_word_on_the_first_event_is_refused_once_the_guard_has_another(office):
    office.fire(20, severity=0.9, now=5.0)
    assert office.progress(GUARD, "failed", 6.0, event=1)[0].code == m.UNKNOWN_EVENT
    assert office.finds(GUARD, "confirmed", 6.0, event=1)[0].code == m.OK  # it was sent there


def test_a_policy_that_grabs_everybody_cannot_keep_an_event_beyond_its_deadline():
    office = Office(Grabbing(), Rules(escalate_after=60.0, merge_distance=0.0))
    office.busy(ROBOT, OPERATOR)
    for now in range(90):
        office.ok(office.fire(80, now=now), now)
    late = [e for e in office.core.events.open.values() if e.waiting_since <= 29]
    assert all(e.state is State.ASSIGNED for e in late)
    assert office.core.counters["preempted"] >= 59
    assert len(office.working) == 3


def test_a_policy_that_does_not_preempt_never_sees_who_is_busy():
    class Watching(Grabbing):
        preempts = False

        def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
            assert all(r.engaged is None for r in situation.responders)
            assert all(t.engaged is None for t in situation.tasks)
            return super().advise(situation, rng)

    office = Office(Watching())
    office.ok(office.fire(80))
    office.ok(office.fire(40))
    office.fire(60)
    assert office.core.counters["policy failed"] == 0
