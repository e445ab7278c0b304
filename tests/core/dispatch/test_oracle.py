"""Best possible dispatch with knowledge of the future."""

from itertools import permutations, product

import numpy as np
import pytest
from helpers.dva.dispatch_situations import INF, look, pairs, situation
from helpers.processes.search_settings import search
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.core.dispatch import Instance, MinEta, OraclePolicy, Policy, solve


def instance(release, arrival, busy):
    return Instance(*(np.array(x, dtype=float) for x in (release, arrival, busy)))


# One unit; a far event comes a moment before a near one.
HOLD = instance([0, 1], [[100], [5]], [[200], [10]])


def test_it_holds_a_unit_back_for_what_it_knows_will_come():
    """Far first: 100 + (200 + 5 - 1) = 304; near first: 5 + (11 + 100) = 116."""
    plan = solve(HOLD)
    assert plan.tours == ((1, 0),)
    assert plan.start == (11.0, 1.0)
    assert plan.total == 116.0


def test_what_nobody_can_go_to_is_left_out():
    plan = solve(instance([0, 0], [[INF, INF], [INF, 7]], [[INF, INF], [INF, 9]]))
    assert (plan.tours, plan.total) == (((), (1,)), 7.0)
    assert solve(instance([], np.empty((0, 2)), np.empty((0, 2)))).total == 0.0


def best_by_trying(given_):
    events, units = given_.arrival.shape
    best = INF
    for order in permutations(range(events)):
        for choice in product(range(units), repeat=events):
            best = min(best, _total(given_, order, choice))
    return best


def _total(given_, order, choice):
    free, total = [0.0] * given_.arrival.shape[1], 0.0
    for event, unit in zip(order, choice, strict=True):
        start = max(free[unit], given_.release[event])
        free[unit] = start + given_.busy[event, unit]
        total += start + given_.arrival[event, unit] - given_.release[event]
    return total


@search(60)
@given(st.data())
def test_no_order_and_no_choice_of_units_is_better(data):
    events, units = data.draw(st.integers(1, 4)), data.draw(st.integers(1, 3))
    release = sorted(data.draw(st.lists(st.integers(0, 60), min_size=events, max_size=events)))
    times = st.lists(st.integers(1, 50), min_size=units, max_size=units)
    arrival = np.array(data.draw(st.lists(times, min_size=events, max_size=events)), dtype=float)
    back = np.array(data.draw(st.lists(times, min_size=events, max_size=events)), dtype=float)
    if data.draw(st.booleans()):
        back[0, 0] = arrival[0, 0] = INF if units > 1 else arrival[0, 0]
    given_ = instance(release, arrival, arrival + back)
    assert solve(given_).total == pytest.approx(best_by_trying(given_))


def play(policy: Policy, given_: Instance) -> float:
    """Sum of response times when a policy is asked at each release and return."""
    events, units = given_.arrival.shape
    free, sent, moments = [0.0] * units, set(), sorted(set(given_.release.tolist()))
    total = 0.0
    while moments:
        now = moments.pop(0)
        known = [e for e in range(events) if given_.release[e] <= now and e not in sent]
        idle = [u for u in range(units) if free[u] <= now]
        tasks = [look(e + 1, since=float(given_.release[e])) for e in known]
        if not tasks or not idle:
            continue
        seen = situation("g" * len(idle), given_.arrival[np.ix_(known, idle)], tasks, now=now)
        named = [who.device for who in seen.responders]
        policy.devices = [named[idle.index(u)] if u in idle else "away" for u in range(units)]
        for task, place in pairs(policy, seen):
            event, unit = known[task], idle[place]
            sent.add(event)
            free[unit] = now + given_.busy[event, unit]
            total += now + given_.arrival[event, unit] - given_.release[event]
            moments = sorted({*moments, free[unit]})
    assert len(sent) == events
    return total


@pytest.mark.parametrize("seed", range(10))
def test_followed_event_by_event_the_plan_costs_what_it_says_and_no_more_than_others(seed):
    rng = np.random.default_rng(seed)
    arrival = np.round(rng.uniform(10, 120, (6, 2)))
    given_ = Instance(np.sort(np.round(rng.uniform(0, 300, 6))), arrival, 2 * arrival + 30)
    plan = solve(given_)
    assert play(OraclePolicy(plan, ("a", "b")), given_) == pytest.approx(plan.total)
    assert plan.total <= play(MinEta(), given_) + 1e-9


def test_a_unit_waits_for_what_its_plan_serves_first():
    policy = OraclePolicy(solve(HOLD), ("guard-0",))
    assert pairs(policy, situation("g", [[100]], [look(1)], now=0.0)) == []
    assert pairs(policy, situation("g", [[100], [5]], [look(1), look(2)], now=1.0)) == [(1, 0)]
    assert pairs(policy, situation("g", [[100]], [look(1)], now=11.0)) == [(0, 0)]


@pytest.mark.parametrize("spread", [0, 50, 1000])
def test_eight_events_and_three_units_are_few_enough(spread):
    rng = np.random.default_rng(4)
    arrival = rng.uniform(10, 200, (8, 3))
    given_ = Instance(np.sort(rng.uniform(0, spread, 8)), arrival, 2 * arrival + 30)
    assert solve(given_).total <= play(MinEta(), given_)
