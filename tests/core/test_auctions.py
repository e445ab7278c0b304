"""Tasks on offer: who is asked, whose bid counts, and what becomes of an award."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from helpers.dva.dispatch_office import (
    DETECTOR,
    GUARD,
    OPERATOR,
    OTHER_GUARD,
    OTHER_OPERATOR,
    ROBOT,
    Office,
    east,
)

from dva_sim.core.assignments import Rules
from dva_sim.core.dispatch import Advice, Announcement, Assignment, Auction, Policy, Situation
from dva_sim.core.events import State
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m

OFFER = m.TaskAnnouncement(1, "fire", east(12), 0.5, 2.0)
AWARD = m.TaskAward(1)


@pytest.fixture
def office() -> Office:
    """Two guards and a robot are asked at 0 s; bids are taken for 2 s."""
    office = Office(Auction())
    office.register(OTHER_GUARD, "Guard", 80)
    sends = office.fire(12)
    assert sends == [Send(who, OFFER) for who in (GUARD, OTHER_GUARD, ROBOT)]
    assert office.ok(sends) == []
    return office


def test_the_task_goes_to_the_earliest_arrival_when_all_have_bid(office):
    assert office.bids(GUARD, 30.0, 0.5)[1] == []
    assert office.bids(ROBOT, 50.0, 0.6)[1] == []
    assert office.bids(OTHER_GUARD, 20.0, 1.0)[1] == [Send(OTHER_GUARD, AWARD)]
    assert (office.event().state, office.event().responder) == (State.ASSIGNED, OTHER_GUARD)
    assert office.event().sent == {OTHER_GUARD}


def test_when_the_time_is_up_the_best_of_those_who_have_bid_gets_it(office):
    office.bids(GUARD, 30.0, 0.5)
    assert office.tick(1.9) == []
    assert office.core.next_deadline() == 2.0
    assert office.tick(2.0) == [Send(GUARD, AWARD)]


def test_arrival_counts_from_when_the_bid_came(office):
    office.bids(OTHER_GUARD, 20.0, 0.1)
    office.bids(GUARD, 19.0, 1.9)
    assert office.tick(2.0) == [Send(OTHER_GUARD, AWARD)]


def test_a_policy_sees_how_far_off_each_arrival_is_now(office):
    office.bids(GUARD, 30.0, 0.5)
    offers = office.core.dispatcher.auctions.bids([office.event()], [OTHER_GUARD, GUARD], 1.5)
    assert np.array_equal(offers, [[np.nan, 29.0]], equal_nan=True)


def test_a_bid_that_comes_too_late_is_refused(office):
    assert office.bids(GUARD, 5.0, 2.1)[0].code == m.UNKNOWN_EVENT


def test_of_two_bids_the_first_counts_and_the_second_is_refused(office):
    office.bids(GUARD, 30.0, 0.5)
    office.bids(OTHER_GUARD, 20.0, 0.6)
    assert office.bids(GUARD, 1.0, 0.7)[0].code == m.UNKNOWN_EVENT
    assert office.tick(2.0) == [Send(OTHER_GUARD, AWARD)]


@pytest.mark.parametrize(("who", "event"), [(OPERATOR, 1), (DETECTOR, 1), (GUARD, 2)])
def test_a_bid_that_nobody_asked_for_is_refused(office, who, event):
    assert office.bids(who, 5.0, 0.5, event)[0].code == m.UNKNOWN_EVENT


def test_who_cannot_be_reached_is_not_waited_for(office):
    office.bids(GUARD, 30.0, 0.5)
    assert office.no([Send(OTHER_GUARD, OFFER)], 0.6) == []
    assert office.no([Send(ROBOT, OFFER)], 0.7) == [Send(GUARD, AWARD)]


def test_an_award_that_is_refused_is_offered_again_to_the_others(office):
    office.bids(GUARD, 30.0, 0.5)
    award = office.tick(2.0)
    assert office.no(award, 2.5) == []
    assert [(s.to, type(s.body)) for s in office.tick(3.0)] == [
        (OTHER_GUARD, m.TaskAnnouncement),
        (ROBOT, m.TaskAnnouncement),
    ]
    assert office.event().attempts == 0


def test_where_nobody_bids_the_task_is_offered_again_until_its_deadline(office):
    now = 0.0
    while office.event().open:
        now += 2.0
        office.tick(now)
        assert now <= 60
    assert office.event().state is State.ESCALATED
    assert office.core.counters["auctions"] >= 15


def test_a_robots_award_is_followed_by_the_order_to_its_operator(office):
    office.bids(ROBOT, 5.0, 0.5)
    award = office.tick(2.0)
    assert award == [Send(ROBOT, AWARD)]
    assert office.working == {ROBOT: 1, OPERATOR: 1}
    order = office.ok(award, 2.1)
    assert order == [Send(OPERATOR, m.Order(1, "fire", east(12), ROBOT))]
    assert office.event().attempts == 0
    office.ok(order, 2.2)
    assert office.event().attempts == 1


def test_a_robot_that_refuses_its_award_frees_its_operator(office):
    office.bids(ROBOT, 5.0, 0.5)
    office.no(office.tick(2.0), 2.1)
    assert office.working == {}
    assert office.event().state is State.PENDING


def test_an_operator_that_declines_frees_the_robot_that_was_awarded(office):
    office.bids(ROBOT, 5.0, 0.5)
    office.no(office.ok(office.tick(2.0), 2.1), 2.2)
    assert office.working == {}
    assert office.event().state is State.PENDING


def test_an_award_answered_after_its_event_was_settled_binds_nobody(office):
    """Somebody sent earlier has found out: the operator was never told, and is free."""
    office.event().sent.add(GUARD)
    office.bids(ROBOT, 5.0, 0.5)
    award = office.tick(2.0)
    office.finds(GUARD, "confirmed", 2.05)
    assert office.ok(award, 2.1) == []
    assert office.working == {}


def test_an_auction_ends_with_its_event(office):
    office.bids(GUARD, 30.0, 0.5)
    office.withdraw(12, now=1.0)
    assert office.event().state is State.EXPIRED
    assert office.bids(OTHER_GUARD, 1.0, 1.1)[1] == []
    office.tick(2.0)
    assert office.core.dispatcher.auctions.running == {}
    assert office.core.next_deadline() > 2.0


def test_an_auction_whose_only_bidder_has_gone_begins_again():
    """Else an event with endless patience would wait for a bidder for ever."""
    office = Office(Auction(), Rules(escalate_after=math.inf))
    office.busy(ROBOT, OPERATOR)
    office.fire(12)
    office.bids(GUARD, 30.0, 0.5)
    office.register(OTHER_GUARD, "Guard", 80, now=0.6)
    office.event().state = State.PENDING
    office.beat(OTHER_GUARD, now=12.0)
    sends = office.core.tick(12.0)
    assert sends == [Send(OTHER_GUARD, OFFER)]


def test_without_anybody_idle_an_auction_that_is_over_is_no_deadline():
    office = Office(Auction(), Rules(escalate_after=math.inf))
    office.busy(ROBOT, OPERATOR)
    office.fire(12)
    office.busy(GUARD)
    office.tick(2.0)
    assert office.core.next_deadline() > 2.0


def test_idle_devices_only_are_asked():
    office = Office(Auction())
    office.register(OTHER_GUARD, "Guard", 80)
    office.busy(GUARD, OPERATOR)
    assert [send.to for send in office.fire(12)] == [OTHER_GUARD]


def test_while_one_task_is_on_offer_the_next_one_waits_its_turn(office):
    assert office.fire(90, now=0.5) == []
    office.bids(GUARD, 30.0, 0.6)
    sends = office.tick(2.0)
    assert sends[0] == Send(GUARD, AWARD)
    office.tick(3.0)
    offered = [s for s in office.sent if isinstance(s.body, m.TaskAnnouncement)]
    assert {s.to for s in offered if s.body.event_id == 2} <= {OTHER_GUARD, ROBOT}


class Chaos(Policy):
    """Announces twice, and gives at once what it announces."""

    auctions = True

    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        return [Announcement(0), Announcement(0), Assignment(0, 0), Announcement(0)]


def test_a_task_is_announced_once_and_not_at_all_when_it_is_given():
    office = Office(Chaos())
    office.register(OTHER_OPERATOR, "TeleOp")
    sends = office.fire(12)
    assert [type(send.body) for send in sends] == [m.TaskAnnouncement] * 2 + [m.Order]
    assert office.core.counters["overruled"] == 2
    assert office.core.dispatcher.auctions.running == {}
    assert office.bids(ROBOT, 1.0, 0.5)[0].code == m.UNKNOWN_EVENT
