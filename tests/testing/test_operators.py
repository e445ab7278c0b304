"""Promises of operator strategies: kept by the shipped ones, missed by bad ones."""

import itertools
import math
import random
import sys
import time

import pytest
from helpers.processes.search_settings import LONGER
from helpers.wording import unnamed

from dva_sim.agents.operator.strategies import (
    Intent,
    Pursuit,
    Strategy,
    known_strategies,
    load_strategy,
)
from dva_sim.testing.operators import check_operator
from dva_sim.testing.promises import tried

STAND = Intent(0.0, 0.0)
SHIPPED = [name for name in known_strategies() if name != "oracle"]


@pytest.mark.parametrize("name", [*SHIPPED, "stepwise.py:Stepwise"])
def test_every_strategy_that_is_shipped_keeps_its_promises(fewer, name):
    outcome = tried(check_operator, name, slow=60.0)
    assert (outcome.broken, outcome.warnings) == ((), ())
    assert outcome.tries == (21 if LONGER > 1 else 17)


count = itertools.count(1)


def steers(drive):
    """A strategy that wants something else, given what pursuit wants and the view."""

    def other(self, route, view, stop_before):
        return drive(Pursuit.drive(self, route, view, stop_before), view)

    return type("Bad", (Pursuit,), {"drive": other})


class Twitchy(Pursuit):
    def point(self, view):
        return view.seen.target_x - view.seen.x, 0.0


class Peeping(Pursuit):
    def drive(self, route, view, stop_before):
        caller = sys._getframe(1).f_locals
        y = caller["y"] if isinstance(caller.get("y"), float) else view.seen.y
        return super().drive(route, view._replace(seen=view.seen._replace(y=y)), stop_before)


class Restless(Pursuit):
    def drive(self, route, view, stop_before):
        wanted = super().drive(route, view, 0.0)
        return Intent(max(wanted.speed, 0.02), wanted.turn_rate)


def later(share):
    """For a minute it steers as it should."""
    return steers(
        lambda wanted, view: (
            wanted if view.now < 60.0 else Intent(share() * wanted.speed, wanted.turn_rate)
        )
    )


TURN = "wants a turn rate beyond reach"
NO_NUMBERS = "answers no two finite numbers"
REMEMBERS = "remembers what another one did, or draws random numbers"


@pytest.mark.parametrize(
    ("kind", "promise"),
    [
        (steers(lambda _, view: Intent(view.seen.speed / (view.delay or math.nan), 0)), NO_NUMBERS),
        (steers(lambda *_: None), NO_NUMBERS),
        (steers(lambda wanted, _: Intent(0.6, wanted.turn_rate)), "wants a speed beyond reach"),
        (
            steers(lambda _, view: Intent(0.0, 1e3 * view.seen.heading)),
            TURN,
        ),
        (Twitchy, "gives a cursor a velocity beyond reach"),
        (steers(lambda _, view: Intent(0.1 / view.delay, 0.0)), "raises"),
        (steers(lambda *_: Intent(0.4, 0.0) if next(count) % 7 else STAND), REMEMBERS),
        (steers(lambda *_: Intent(random.uniform(0.0, 0.5), 0.0)), REMEMBERS),
        (later(random.random), REMEMBERS),
        (later(lambda: time.perf_counter() % 1.0), REMEMBERS),
        (Peeping, "sees what no picture has shown yet"),
        (steers(lambda *_: Intent(0.5, 0.0)), "leaves a wide corridor"),
        (steers(lambda *_: STAND), "does not arrive"),
        (Restless, "does not stand at the end of its way"),
    ],
)
def test_a_broken_promise_is_found(fewer, kind, promise):
    reports = [text.partition(":")[0] for text in tried(check_operator, kind, slow=60.0).broken]
    assert promise in reports


Crawling = steers(lambda wanted, _: Intent(0.1 * wanted.speed, 0.1 * wanted.turn_rate))


def test_who_is_only_slow_is_warned(fewer):
    outcome = tried(check_operator, Crawling, slow=60.0)
    assert outcome.broken == ()
    assert any(text.startswith("is slow: ") for text in outcome.warnings)
    (text,) = tried(check_operator, steers(lambda wanted, _: wanted), slow=0.0).warnings
    assert text.startswith("thinks slowly: ")


def test_a_strategy_is_tried_without_the_limits_that_it_is_held_within_when_it_runs(tmp_path):
    head = "from dva_sim.agents.operator.strategies import Intent, Strategy\n"
    body = "class Mine(Strategy):\n def drive(self, route, view, stop_before): return 9, 9\n"
    (tmp_path / "mine.py").write_text(head + body)
    outcome = tried(check_operator, load_strategy("mine.py:Mine", base=tmp_path))
    assert unnamed(outcome.broken[0], "speed beyond reach", "(9, 9)") == []
    assert issubclass(Pursuit, Strategy)
