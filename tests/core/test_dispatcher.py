"""Dispatcher: the situation that a policy sees, and the treatment of good and bad advice."""

import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from helpers.dva.dispatch_office import (
    DETECTOR,
    GUARD,
    OPERATOR,
    OTHER_GUARD,
    OTHER_ROBOT,
    ROBOT,
    Office,
    crow,
    east,
)

from dva_sim.core.assignments import Rules
from dva_sim.core.dispatch import Advice, Announcement, Assignment, Policy, Relocation, Situation
from dva_sim.core.events import State
from dva_sim.core.sessions import Send
from dva_sim.core.travel_times import SiteKnowledge, WaitingPlace
from dva_sim.protocol import messages as m


class Advising(Policy):
    """Says what it was told to say."""

    def __init__(self, advice: Callable[[Situation], Any], **wants: bool) -> None:
        self._advice = advice
        self.seen: list[Situation] = []
        for name, value in wants.items():
            setattr(self, name, value)

    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        self.seen.append(situation)
        return self._advice(situation)  # type: ignore[no-any-return]


def advised(*advice: Advice, **wants: bool) -> Office:
    return Office(Advising(lambda _: advice, **wants))


# --- who goes ------------------------------------------------------------------------------


def test_the_earliest_expected_arrival_goes():
    office = Office()
    assert office.fire(12) == [Send(OPERATOR, m.Order(1, "fire", east(12), ROBOT))]
    far = office.fire(40, kind="gas_leak")
    assert far == [Send(GUARD, m.Order(2, "gas_leak", east(40), None))]


def test_a_robot_goes_only_with_a_free_operator():
    office = Office()
    office.register(OTHER_ROBOT, "Robot", 10)
    first, second = office.fire(12), office.fire(12, kind="gas_leak")
    assert [s.to for s in first + second] == [OPERATOR, GUARD]


def test_who_has_not_told_where_it_is_is_sent_nowhere():
    office = Office()
    office.busy(GUARD, ROBOT)
    office.register(OTHER_GUARD, "Guard")
    assert office.fire(12) == []
    office.report_place(OTHER_GUARD, 500, now=1.0)
    assert [send.to for send in office.tick(2.0)] == [OTHER_GUARD]


def test_a_silent_device_is_sent_nowhere():
    office = Office()
    office.beat(DETECTOR, OPERATOR, ROBOT, now=11.0)
    office.core.tick(11.0)
    office.busy(ROBOT)
    assert office.fire(12, now=11.0) == []


def test_the_policy_sees_guards_then_robots_and_events_detected_longest_ago_first():
    policy = Advising(lambda _: [])
    office = Office(policy)
    office.register(OTHER_GUARD, "Guard", 80)
    office.fire(12, now=1.0)
    office.fire(90, now=2.0)
    seen = policy.seen[-1]
    assert [r.device for r in seen.responders] == [GUARD, OTHER_GUARD, ROBOT]
    assert [(t.event, t.detected, t.stage, t.due) for t in seen.tasks] == [
        (1, 1.0, "confirm", True),
        (2, 2.0, "confirm", True),
    ]
    assert np.allclose(seen.distance, [[12, 68, 2], [90, 10, 80]], atol=0.01)
    assert seen.operators == 1
    assert (seen.cover, seen.bids.size, seen.preference.size) == (None, 0, 0)


def test_the_policy_sees_the_lists_of_the_place():
    policy = Advising(lambda _: [])
    ground = SiteKnowledge(lambda position, devices: [float(d == GUARD) for d in devices])
    office = Office(policy, ground=ground)
    office.fire(12)
    assert policy.seen[-1].preference.tolist() == [[1.0, 0.0]]


def test_with_nobody_to_send_or_nothing_to_do_the_policy_is_not_asked():
    policy = Advising(lambda _: [])
    office = Office(policy)
    office.tick(1.0)
    office.busy(GUARD, ROBOT)
    office.fire(12)
    assert policy.seen == []


# --- the rules hold ------------------------------------------------------------------------


def everything(situation: Situation) -> list[Advice]:
    every = range(len(situation.tasks))
    return [Assignment(t, r) for t in every for r in range(len(situation.responders))]


def test_the_core_enforces_the_rules_whatever_a_policy_returns():
    office = Office(Advising(everything))
    office.fire(12)
    office.fire(12, kind="gas_leak")
    office.fire(12, kind="flood")
    held = [e.responder for e in office.core.events.in_state(State.ASSIGNED)]
    assert len(held) == len(set(held)) == 2
    counts = office.core.events.counts
    assert (counts[State.ASSIGNED], counts[State.PENDING]) == (2, 1)


@pytest.mark.parametrize(
    ("advice", "taken"),
    [
        ([Assignment(0, 0), Assignment(0, 1)], 1),  # a second responder
        ([Assignment(0, 0), Assignment(0, 0)], 1),  # said twice
        ([Announcement(0)], 0),  # no auctions
    ],
)
def test_what_the_rules_do_not_allow_is_overruled_and_counted(advice, taken):
    office = advised(*advice)
    assert len(office.fire(12)) == taken
    assert office.core.counters["overruled"] == 1
    assert office.core.counters["policy failed"] == 0


def test_more_robots_than_operators_are_overruled():
    office = Office(Advising(lambda s: [Assignment(t, t + 1) for t in range(len(s.tasks))]))
    office.register(OTHER_ROBOT, "Robot", 10)
    office.core.events.add("fire", east(12), 0.5, 0.0)
    office.core.events.add("flood", east(50), 0.5, 0.0)
    assert [send.to for send in office.tick(1.0)] == [OPERATOR]
    assert office.core.counters["overruled"] == 1


def test_nobody_is_sent_where_there_is_no_way():
    def walled(starts: Any, goals: Any) -> Any:
        distance, eta = crow(starts, goals)
        return np.full_like(distance, np.inf), np.full_like(eta, np.inf)

    office = Office(Advising(everything))
    office.core.dispatcher.situations.travel = walled
    assert office.fire(12) == []
    assert office.core.counters["overruled"] == 2


# --- policies that fail --------------------------------------------------------------------


def raises(situation: Situation) -> Any:
    raise RuntimeError("oh no")


def raises_midway(situation: Situation) -> Iterator[Advice]:
    yield Assignment(0, 0)
    raise RuntimeError("oh no")


def mutates(situation: Situation) -> Any:
    situation.eta[:] = 0.0
    return [Assignment(0, 0)]


@pytest.mark.parametrize(
    "advice",
    [
        raises,
        raises_midway,
        mutates,
        lambda s: None,
        lambda s: 5,
        lambda s: [None],
        lambda s: ["send the guard"],
        lambda s: [(0, 0)],
        lambda s: [Assignment(True, 0)],
        lambda s: [Assignment(0, np.True_)],
        lambda s: [Assignment(0, 0.0)],  # type: ignore[arg-type]
        lambda s: [Assignment(0, "0")],  # type: ignore[arg-type]
        lambda s: [Assignment(0, None)],  # type: ignore[arg-type]
        lambda s: [Assignment(-1, 0)],
        lambda s: [Assignment(0, 2)],
        lambda s: [Assignment(10**30, 0)],
        lambda s: [Assignment(0, 0), Assignment(1, 0)],
        lambda s: [Announcement(7)],
        lambda s: sys.exit(3),
        lambda s: [Relocation(0, 0)],
    ],
)
def test_a_policy_that_fails_is_counted_and_the_earliest_arrival_goes(advice):
    office = Office(Advising(advice))
    assert [send.to for send in office.fire(12)] == [OPERATOR]
    assert office.core.counters["policy failed"] == 1
    assert office.core.dispatcher.last_failure


def test_indices_of_numpy_are_as_good_as_any():
    office = Office(Advising(lambda s: [Assignment(np.int64(0), np.uint8(0))]))
    assert [send.to for send in office.fire(12)] == [GUARD]
    assert office.core.counters["policy failed"] == 0


@pytest.mark.parametrize("name", ["distance", "eta", "preference", "bids"])
def test_what_a_policy_is_shown_it_cannot_change(name):
    policy = Advising(lambda _: [], auctions=True)
    office = Office(policy, ground=SiteKnowledge(lambda position, devices: [0.0] * len(devices)))
    office.fire(12)
    assert not getattr(policy.seen[-1], name).flags.writeable


def test_what_is_known_of_the_place_a_policy_cannot_change():
    def spoil(situation: Situation) -> Any:
        assert situation.cover is not None
        situation.cover.reach[:] = 0.0
        return []

    ground = SiteKnowledge(None, (WaitingPlace("post", east(0)),), np.ones((1, 2)), np.full(2, 0.5))
    office = Office(Advising(spoil, relocates=True), ground=ground)
    office.tick(1.0)
    assert office.core.counters["policy failed"] == 1
    assert ground.reach.tolist() == [[1.0, 1.0]]


def test_a_map_that_hands_out_its_own_tables_keeps_them():
    table = np.zeros((1, 3)), np.ones((1, 3))
    office = Office(rules=Rules(containment=True))
    office.register(OTHER_GUARD, "Guard", 80)
    office.core.dispatcher.situations.travel = lambda starts, goals: tuple(
        t[:, : len(starts)] for t in table
    )
    office.fire(12)
    office.finds(GUARD, "confirmed", 3.0)
    office.progress(GUARD, "done", 3.0)
    assert office.event().actor == GUARD  # the robot cannot
    assert np.isfinite(table[1]).all()
