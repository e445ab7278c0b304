"""Confirmed is not over: somebody deals with the event, and may have stood by for that."""

from collections.abc import Sequence

import numpy as np
import pytest
from helpers.dva.dispatch_office import DETECTOR, GUARD, OPERATOR, OTHER_GUARD, ROBOT, Office, east

from dva_sim.core.assignments import Rules
from dva_sim.core.dispatch import Advice, Assignment, HazardTeam, Policy, Situation
from dva_sim.core.events import State
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m

RULES = Rules(containment=True, escalate_after=60.0)
OVER = m.OrderProgress(1, "done")


def order(task: str, event: int = 1) -> m.Order:
    return m.Order(event, "fire", east(12), None, task)


@pytest.fixture
def office() -> Office:
    return Office(rules=RULES)


@pytest.fixture
def standing_by() -> Office:
    """The robot looks, and the guard stands by."""
    office = Office(HazardTeam(), RULES)
    sends = office.fire(12)
    assert [(s.to, s.body.task) for s in sends] == [(OPERATOR, "confirm"), (GUARD, "stand_by")]
    assert office.ok(sends, 1.0) == []
    return office


def test_without_the_rule_a_confirmed_event_is_over():
    office = Office()
    office.fire(12)
    office.finds(OPERATOR, "confirmed", 5.0)
    assert not office.event().open
    assert office.finds(OPERATOR, "contained", 6.0)[1] == []
    assert office.event().state is State.CONFIRMED


def test_a_confirmed_event_is_dealt_with_by_a_person_and_then_over(office):
    office.fire(12, now=1.0)
    sends = office.finds(OPERATOR, "confirmed", 5.0)[1]
    assert sends == [Send(GUARD, order("contain"))]
    office.ok(sends, 5.0)
    office.progress(GUARD, "departed", 8.0)
    office.progress(GUARD, "arrived", 20.0)
    office.finds(GUARD, "contained", 50.0)
    office.progress(GUARD, "done", 51.0)
    event = office.event()
    assert (event.state, event.actor) == (State.CONTAINED, GUARD)
    steps = ("act_assigned", "act_departed", "act_arrived", "contained", "closed")
    assert [event.times[step] for step in steps] == [5.0, 8.0, 20.0, 50.0, 50.0]
    assert office.working == {OPERATOR: 1, ROBOT: 1}  # its operator has not said `done` yet


def test_nobody_can_contain_what_is_not_confirmed(office):
    office.fire(12)
    office.finds(OPERATOR, "contained", 5.0)
    assert office.event().state is State.ON_SCENE


def test_who_has_confirmed_it_is_waited_for_to_deal_with_it_though_another_is_free(office):
    office.register(OTHER_GUARD, "Guard", 80)
    office.busy(ROBOT, OPERATOR)
    office.ok(office.fire(12))
    assert office.finds(GUARD, "confirmed", 30.0)[1] == []
    sends = office.progress(GUARD, "done", 31.0)[1]
    assert sends == [Send(GUARD, order("contain"))]
    office.finds(GUARD, "contained", 60.0)
    office.progress(GUARD, "done", 61.0)
    assert office.event().state is State.CONTAINED
    assert GUARD not in office.working


def test_late_news_of_the_order_to_look_takes_nothing_from_who_deals_with_it(office):
    office.busy(ROBOT, OPERATOR)
    looked = office.fire(12)
    office.finds(GUARD, "confirmed", 20.0)
    office.progress(GUARD, "done", 21.0)
    office.no(looked, 27.0)
    assert (office.event().actor, office.working[GUARD]) == (GUARD, 1)


def test_a_robot_deals_with_nothing_whatever_the_policy_says():
    office = Office(Everything(), RULES)
    office.busy(GUARD)
    office.ok(office.fire(12))
    office.finds(OPERATOR, "confirmed", 5.0)
    assert office.progress(OPERATOR, "done", 6.0)[1] == []
    assert office.event().actor is None


def test_what_nobody_comes_to_contain_within_60_s_is_escalated(office):
    office.busy(GUARD)
    office.fire(12)
    office.finds(OPERATOR, "confirmed", 50.0)
    office.tick(109.9)
    assert office.event().state is State.CONFIRMED
    office.tick(110.0)
    assert office.event().state is State.ESCALATED


def test_a_confirmed_event_that_is_refuted_after_all_is_over_and_its_actor_free(office):
    office.fire(12)
    office.ok(office.finds(OPERATOR, "confirmed", 5.0)[1], 5.0)
    assert office.finds(OPERATOR, "refuted", 6.0)[1] == [Send(GUARD, OVER)]
    assert GUARD not in office.working


def test_who_refutes_it_itself_is_not_told_that_it_is_over(office):
    office.fire(12)
    office.ok(office.finds(OPERATOR, "confirmed", 5.0)[1], 5.0)
    assert office.finds(GUARD, "refuted", 30.0)[1] == []
    assert office.working[GUARD] == 1
    office.progress(GUARD, "done", 31.0)
    assert GUARD not in office.working


def test_the_actor_is_told_if_somebody_else_has_contained_it(office):
    office.fire(12)
    office.ok(office.finds(OPERATOR, "confirmed", 5.0)[1], 5.0)
    assert office.finds(OPERATOR, "contained", 9.0)[1] == [Send(GUARD, OVER)]
    assert GUARD not in office.working


# --- an actor that does not do it ----------------------------------------------------------


def two_guards() -> Office:
    office = Office(rules=RULES)
    office.register(OTHER_GUARD, "Guard", 80)
    office.fire(12)
    office.ok(office.finds(OPERATOR, "confirmed", 5.0)[1], 5.0)
    assert office.event().actor == GUARD
    return office


@pytest.mark.parametrize("word", ["failed", "done"])
def test_an_actor_that_fails_is_replaced_and_that_was_an_attempt(word):
    office = two_guards()
    assert office.event().attempts == 1
    sends = office.progress(GUARD, word, 20.0)[1]
    assert sends == [Send(OTHER_GUARD, order("contain"))]
    assert (office.event().attempts, office.event().waiting_since) == (2, 20.0)


def test_an_actor_that_declines_is_replaced_and_that_was_no_attempt():
    office = Office(rules=RULES)
    office.register(OTHER_GUARD, "Guard", 80)
    office.fire(12)
    office.no(office.finds(OPERATOR, "confirmed", 5.0)[1], 6.0)
    assert office.tick(7.0) == [Send(OTHER_GUARD, order("contain"))]
    assert (office.event().attempts, office.event().waiting_since) == (1, 5.0)


def test_an_actor_that_falls_silent_is_replaced():
    office = two_guards()
    office.beat(OTHER_GUARD, OPERATOR, ROBOT, now=11.0)
    assert office.core.tick(11.0) == [Send(OTHER_GUARD, order("contain"))]
    assert office.event().attempts == 2


def test_the_times_of_the_next_actor_are_its_own():
    office = two_guards()
    office.progress(GUARD, "arrived", 10.0)
    office.progress(GUARD, "failed", 20.0)
    assert "act_arrived" not in office.event().times
    office.finds(OTHER_GUARD, "contained", 50.0)
    times = office.event().times
    steps = ("act_assigned", "act_departed", "act_arrived", "contained")
    assert [times[step] for step in steps] == [20.0, 50.0, 50.0, 50.0]


def test_an_actor_that_needs_more_than_900_s_is_told_and_replaced():
    office = two_guards()
    office.tick(904.9)
    assert office.event().actor == GUARD
    sends = office.tick(905.0)
    assert sends[0] == Send(GUARD, OVER)
    assert Send(OTHER_GUARD, order("contain")) in sends


def test_an_event_that_actors_give_back_four_times_is_escalated():
    office = two_guards()
    now = 10.0
    while office.event().open:
        actor = office.event().actor
        assert actor is not None
        office.progress(actor, "failed", now)
        now += 1
    assert office.event().attempts == 4  # the look was one
    assert office.event().state is State.ESCALATED


# --- standing by ---------------------------------------------------------------------------


def test_who_stands_by_hears_at_once_when_the_event_is_confirmed(standing_by):
    assert standing_by.event().actor == GUARD
    assert standing_by.finds(OPERATOR, "confirmed", 30.0)[1] == [Send(GUARD, order("contain"))]
    standing_by.finds(GUARD, "contained", 60.0)
    assert standing_by.event().state is State.CONTAINED


def test_who_stands_by_is_free_when_the_event_is_refuted(standing_by):
    assert standing_by.finds(OPERATOR, "refuted", 30.0)[1] == [Send(GUARD, OVER)]
    assert GUARD not in standing_by.working


def test_who_stands_by_is_the_one_to_look_when_the_robot_fails(standing_by):
    """Else the event would wait for somebody while the nearest guard stands idle beside it."""
    sends = standing_by.progress(OPERATOR, "failed", 30.0)[1]
    assert sends == [Send(GUARD, OVER), Send(GUARD, order("confirm"))]
    assert standing_by.working == {GUARD: 1}


def test_who_stands_by_is_free_when_the_event_is_escalated_at_its_last_attempt(standing_by):
    standing_by.event().attempts = 4
    assert standing_by.progress(OPERATOR, "failed", 30.0)[1] == [Send(GUARD, OVER)]
    assert standing_by.event().state is State.ESCALATED
    assert standing_by.working == {}


def test_who_stands_by_and_gives_up_costs_the_event_nothing(standing_by):
    standing_by.progress(GUARD, "failed", 20.0)
    event = standing_by.event()
    assert (event.state, event.attempts, event.waiting_since) == (State.ASSIGNED, 1, 0.0)


def test_who_declines_to_stand_by_takes_nothing_from_who_looks():
    office = Office(HazardTeam(), RULES)
    stand_by = [send for send in office.fire(12) if send.to == GUARD]
    office.no(stand_by, 2.0)
    assert office.event().actor is None
    assert office.working == {OPERATOR: 1, ROBOT: 1}


def test_who_stands_by_may_do_so_for_longer_than_an_order_takes(standing_by):
    standing_by.core.registry.silent_after = 1e9
    standing_by.event().times["assigned"] = 600.0
    assert standing_by.tick(1000.0) == []
    assert standing_by.event().actor == GUARD


def test_an_event_that_needs_no_containment_needs_nobody_to_stand_by():
    class Eager(Everything):
        preempts = True

    office = Office(Eager())
    office.fire(12)
    office.fire(80)
    assert all(event.actor is None for event in office.core.events.open.values())


class Everything(Policy):
    """Gives every task to everybody."""

    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        every = range(len(situation.tasks))
        return [Assignment(t, r) for t in every for r in range(len(situation.responders))]


def test_after_a_restart_every_order_that_stands_is_said_again(standing_by):
    again = standing_by.core.orders.again()
    assert [(s.to, s.body.task) for s in again] == [(OPERATOR, "confirm"), (GUARD, "stand_by")]
    standing_by.finds(OPERATOR, "confirmed", 30.0)
    standing_by.progress(OPERATOR, "done", 31.0)
    assert standing_by.core.orders.again() == [Send(GUARD, order("contain"))]


def test_a_detector_is_never_asked_to_do_anything(standing_by):
    assert DETECTOR not in {send.to for send in standing_by.sent}
