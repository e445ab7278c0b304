"""Idle guards wait where they are of most use."""

from collections.abc import Sequence

import numpy as np
import pytest
from helpers.dva.dispatch_office import GUARD, OPERATOR, ROBOT, Office, east

from dva_sim.core.dispatch import Advice, Coverage, MinEta, Policy, Relocation, Situation
from dva_sim.core.sessions import Send
from dva_sim.core.travel_times import SiteKnowledge, WaitingPlace
from dva_sim.protocol import messages as m

THERE = m.Relocation(east(90))
GROUND = SiteKnowledge(
    None,
    (WaitingPlace("west", east(0)), WaitingPlace("east", east(90))),
    np.array([[0.0, 90.0], [90.0, 0.0]]),
    np.array([0.1, 0.9]),
)


class Eastward(MinEta):
    """Sends everybody to wait in the east, again and again."""

    relocates = True

    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        moves = [Relocation(r, 1) for r in range(len(situation.responders))]
        return [*super().advise(situation, rng), *moves]


def office_of(policy: Policy) -> Office:
    return Office(policy, ground=GROUND)


def test_an_idle_guard_is_sent_where_events_are_expected():
    office = office_of(Coverage())
    assert office.tick(1.0) == [Send(GUARD, THERE)]
    assert office.core.counters["relocated"] == 1


def test_a_guard_on_its_way_is_not_sent_there_again():
    office = office_of(Eastward())
    assert office.tick(1.0) == [Send(GUARD, THERE)]
    overruled = office.core.counters["overruled"]
    assert office.tick(2.0) == []
    assert office.core.counters["overruled"] == overruled + 2  # the robot, and the guard again


def test_a_robot_is_never_sent_to_wait():
    office = office_of(Eastward())
    assert ROBOT not in {send.to for send in office.tick(1.0)}
    assert office.core.counters["overruled"] == 1


def test_who_has_an_order_is_not_sent_to_wait():
    office = office_of(Eastward())
    office.busy(ROBOT, OPERATOR)
    assert office.fire(12) == [Send(GUARD, m.Order(1, "fire", east(12), None))]
    assert office.tick(1.0) == []


class Grabbing(Eastward):
    """It may call away who is under way, and would rather have everybody wait in the east."""

    preempts = True


def test_a_guard_under_way_to_an_event_is_not_sent_to_wait():
    office = office_of(Grabbing())
    office.busy(ROBOT, OPERATOR)
    office.ok(office.fire(12))
    office.progress(GUARD, "accepted")
    overruled = office.core.counters["overruled"]
    assert office.tick(1.0) == []
    assert office.core.counters["overruled"] > overruled  # it was advised
    assert office.core.counters["relocated"] == 0
    assert office.working[GUARD] == 1


def test_an_order_interrupts_the_way_and_the_guard_may_be_sent_again_after_it():
    office = office_of(Eastward())
    office.busy(ROBOT, OPERATOR)
    office.tick(1.0)
    assert [send.to for send in office.fire(12, now=2.0)] == [GUARD]
    office.finds(GUARD, "refuted", 30.0)
    assert office.progress(GUARD, "done", 31.0)[1] == [Send(GUARD, THERE)]


def test_a_guard_that_has_arrived_is_bound_for_nowhere():
    office = office_of(Eastward())
    office.tick(1.0)
    office.report_place(GUARD, 90, now=80.0)
    office.report_place(GUARD, 0, now=81.0)
    assert office.tick(82.0) == []
    office.report_place(GUARD, 90, now=90.0)
    office.tick(91.0)
    office.report_place(GUARD, 0, now=92.0)
    assert office.tick(93.0) == [Send(GUARD, THERE)]


def test_a_guard_that_declines_to_move_is_bound_for_nowhere():
    office = office_of(Eastward())
    office.no(office.tick(1.0), 2.0)
    assert office.tick(3.0) == [Send(GUARD, THERE)]


def test_a_guard_that_restarted_is_bound_for_nowhere():
    office = office_of(Eastward())
    office.register(GUARD, "Guard")
    office.tick(1.0)
    office.number = 1  # it counts its messages from the beginning again
    office.register(GUARD, "Guard", 0, now=2.0)
    assert office.tick(3.0) == [Send(GUARD, THERE)]


def test_a_guard_that_never_arrives_counts_as_bound_for_twice_its_time_and_3_minutes():
    office = office_of(Eastward())
    office.tick(1.0)  # 90 m at 1.3 m/s: 69.2 s
    assert office.tick(1.0 + 2 * 69.2 + 179.0) == []
    assert office.tick(1.0 + 2 * 69.2 + 181.0) == [Send(GUARD, THERE)]


def test_without_stations_nobody_is_moved():
    office = Office(Coverage())
    assert office.tick(1.0) == []
    assert office.core.counters["policy failed"] == 0


@pytest.mark.parametrize("policy", [MinEta, Coverage])
def test_where_nobody_is_idle_nothing_is_asked(policy):
    office = office_of(policy())
    office.busy(GUARD, ROBOT)
    assert office.tick(1.0) == []
