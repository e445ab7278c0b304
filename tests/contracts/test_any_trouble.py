"""Whatever is lost, doubled, late or overtaken: each request ends once, and in its own reply."""

from random import Random

import pytest
from helpers.network.transports import (
    BRIEF,
    NODES,
    PHONE,
    ROBOT,
    TABLET,
    VIRTUAL,
    Asker,
    Meddled,
    Meddler,
    Plan,
    Tap,
    VirtualWorld,
    World,
    echo,
    numbered,
)
from helpers.processes.search_settings import search
from hypothesis import given
from hypothesis import strategies as st

pytestmark = pytest.mark.contract

plans = st.builds(Plan, st.floats(0, 0.9), st.floats(0, 1), st.floats(0, 5 * BRIEF))


def ask_in_trouble(
    world: World, seed: int, plan: Plan, window: int, attempts: int = 3, count: int = 12
) -> None:
    """Two ask at moments of their own; the service comes and goes; then all is looked at."""
    meddler, rng = Meddler(world.clock, seed, plan), Random(seed)
    Meddled(world.network, meddler).serve(ROBOT, echo)
    taps = [Tap(world.network), Tap(world.network)]
    askers = [
        Asker(tap, BRIEF, window, attempts, node)
        for tap, node in zip(taps, (PHONE, TABLET), strict=True)
    ]
    start = world.clock.now
    for number, asker in enumerate(askers):
        for question in numbered(count, f"asker {number} of seed {seed}, question"):
            asker.ends[question] = []
            world.clock.call_at(start + rng.uniform(0, 2 * BRIEF), asker.ask, question)
    world.run_until(lambda: all(asker.all_over() for asker in askers))
    world.run_for(2 * plan.hold + BRIEF)
    for tap, asker in zip(taps, askers, strict=True):
        for question, reply in zip(asker.ends, asker.replies(), strict=True):
            assert reply in (b"re: " + question, None)
            sent = tap.sent.count(question)
            assert sent == attempts if reply is None else 1 <= sent <= attempts
        failures = asker.replies().count(None)
        assert asker.requester.failures == failures
        assert asker.requester.timeouts == len(tap.sent) - count + failures
        assert not asker.requester.busy


@pytest.mark.system
@pytest.mark.parametrize("kind", VIRTUAL)
@search(40)
@given(
    seed=st.integers(0, 2**32),
    plan=plans,
    window=st.integers(1, 8),
    attempts=st.integers(1, 4),
)
def test_each_request_ends_once_in_virtual_time(kind, seed, plan, window, attempts):
    ask_in_trouble(VirtualWorld(VIRTUAL[kind]()), seed, plan, window, attempts)


@pytest.mark.system
def test_each_request_ends_once_over_sockets(sockets):
    plan = Plan(lose=0.25, double=0.5, hold=1.5 * BRIEF)
    ask_in_trouble(sockets, 1, plan, window=3 if sockets.ring else 1, count=5)


@pytest.mark.parametrize("kind", VIRTUAL)
@search(25)
@given(
    seed=st.integers(0, 2**32),
    absences=st.lists(
        st.tuples(st.sampled_from(NODES), st.floats(0.01, 3), st.floats(0.01, 3)), max_size=8
    ),
    window=st.integers(1, 4),
)
def test_each_request_ends_once_while_nodes_come_and_go_in_virtual_time(
    kind, seed, absences, window
):
    world = VirtualWorld(VIRTUAL[kind]())
    for node, at, duration in absences:
        world.clock.call_at(at, world.leave, node)
        world.clock.call_at(at + duration, world.come_back, node)
    ask_in_trouble(world, seed, Plan(lose=0.1, double=0.3, hold=BRIEF), window)


@pytest.mark.system
def test_each_request_ends_once_while_the_service_comes_and_goes_over_sockets(sockets):
    for at in (0.3, 0.9):
        sockets.clock.call_after(at, sockets.leave, ROBOT)
        sockets.clock.call_after(at + 0.2, sockets.come_back_soon, ROBOT)
    plan = Plan(lose=0.1, double=0.3, hold=BRIEF)
    ask_in_trouble(sockets, 1, plan, window=3 if sockets.ring else 1, count=6)
