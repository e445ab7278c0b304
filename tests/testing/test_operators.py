"""What every way of steering promises: kept by those that are shipped, missed by bad ones."""

from __future__ import annotations

import math
import random
import sys
import time

import pytest

from dva_sim.agents.operator.strategies import (
    Intent,
    Pursuit,
    Strategy,
    known_strategies,
    load_strategy,
)
from dva_sim.cli import checks
from dva_sim.kernel.errors import ConfigError
from dva_sim.testing.operators import check_operator
from dva_sim.testing.promises import tried

STAND = Intent(0.0, 0.0)
SHIPPED = [name for name in known_strategies() if name != "oracle"]


@pytest.mark.parametrize("name", [*SHIPPED, "stepwise.py:Stepwise"])
def test_every_strategy_that_is_shipped_keeps_its_promises(name):
    outcome = tried(check_operator, name, slow=60.0)
    assert (outcome.broken, outcome.warnings) == ((), ())
    assert outcome.tries == 21


class Numberless(Pursuit):
    def drive(self, route, view, stop_before):
        return Intent(view.seen.speed / view.delay if view.delay else math.nan, 0.0)


class Silent(Pursuit):
    def drive(self, route, view, stop_before):
        return None


class Reckless(Pursuit):
    def drive(self, route, view, stop_before):
        return Intent(0.6, super().drive(route, view, stop_before).turn_rate)


class Spinner(Pursuit):
    def drive(self, route, view, stop_before):
        return Intent(0.0, 1000.0 * view.seen.heading)


class Twitchy(Pursuit):
    def point(self, view):
        return view.seen.target_x - view.seen.x, 0.0


class Divider(Pursuit):
    def drive(self, route, view, stop_before):
        return Intent(0.1 / view.delay, 0.0)


class Forgetless(Pursuit):
    asked = 0

    def drive(self, route, view, stop_before):
        type(self).asked += 1  # shared by all of the class
        return Intent(0.4, 0.0) if self.asked % 7 else STAND


class Lucky(Pursuit):
    def drive(self, route, view, stop_before):
        return Intent(random.uniform(0.0, 0.5), 0.0)


class LuckyLater(Pursuit):
    def drive(self, route, view, stop_before):
        wanted = super().drive(route, view, stop_before)
        return wanted if view.now < 60.0 else Intent(random.uniform(0.0, 0.5), wanted.turn_rate)


class ClockedLater(Pursuit):
    def drive(self, route, view, stop_before):
        wanted = super().drive(route, view, stop_before)
        share = 1.0 if view.now < 60.0 else time.perf_counter() % 1.0
        return Intent(share * wanted.speed, wanted.turn_rate)


class Peeping(Pursuit):
    def drive(self, route, view, stop_before):
        caller = sys._getframe(1).f_locals
        y = caller["y"] if isinstance(caller.get("y"), float) else view.seen.y
        return super().drive(route, view._replace(seen=view.seen._replace(y=y)), stop_before)


class Straight(Pursuit):
    def drive(self, route, view, stop_before):
        return Intent(0.5, 0.0)


class Lazy(Pursuit):
    def drive(self, route, view, stop_before):
        return STAND


class Restless(Pursuit):
    def drive(self, route, view, stop_before):
        wanted = super().drive(route, view, 0.0)
        return Intent(max(wanted.speed, 0.02), wanted.turn_rate)


@pytest.mark.parametrize(
    ("kind", "promise"),
    [
        (Numberless, "answers no two finite numbers"),
        (Silent, "answers no two finite numbers"),
        (Reckless, "wants a speed beyond reach"),
        (Spinner, "wants a turn rate beyond reach"),
        (Twitchy, "gives a cursor a velocity beyond reach"),
        (Divider, "raises"),
        (Forgetless, "remembers what another one did, or draws random numbers"),
        (Lucky, "remembers what another one did, or draws random numbers"),
        (LuckyLater, "remembers what another one did, or draws random numbers"),
        (ClockedLater, "remembers what another one did, or draws random numbers"),
        (Peeping, "sees what no picture has shown yet"),
        (Straight, "leaves a wide corridor"),
        (Lazy, "does not arrive"),
        (Restless, "does not stand at the end of its way"),
    ],
)
def test_a_broken_promise_is_found(kind, promise):
    told = [text.partition(":")[0] for text in tried(check_operator, kind, slow=60.0).broken]
    assert promise in told


class Crawling(Pursuit):
    def drive(self, route, view, stop_before):
        speed, turn_rate = super().drive(route, view, stop_before)
        return Intent(0.1 * speed, 0.1 * turn_rate)


class Thinking(Pursuit):
    def drive(self, route, view, stop_before):
        time.perf_counter_ns()
        return super().drive(route, view, stop_before)


def test_who_is_only_slow_is_warned():
    outcome = tried(check_operator, Crawling, slow=60.0)
    assert outcome.broken == ()
    assert any(text.startswith("is slow: ") for text in outcome.warnings)
    (text,) = tried(check_operator, Thinking, slow=0.0).warnings
    assert text.startswith("thinks slowly: ")


def test_the_oracle_sees_nothing_and_so_there_is_nothing_to_try():
    with pytest.raises(ConfigError, match="is told the truth, and sees nothing"):
        tried(check_operator, "oracle")


def test_a_strategy_is_tried_without_the_limits_that_it_is_held_within_when_it_runs(tmp_path):
    head = "from dva_sim.agents.operator.strategies import Intent, Strategy\n"
    body = "class Mine(Strategy):\n def drive(self, route, view, stop_before): return 9, 9\n"
    (tmp_path / "mine.py").write_text(head + body)
    outcome = tried(check_operator, load_strategy("mine.py:Mine", base=tmp_path))
    assert outcome.broken[0].startswith("wants a speed beyond reach: (9, 9)")
    assert issubclass(Pursuit, Strategy)


def test_a_strategy_that_ends_the_program_is_told_in_a_line(tmp_path, capsys):
    path = tmp_path / "leaving.py"
    path.write_text(
        "from dva_sim.agents.operator.strategies import Strategy\n"
        "class Leaving(Strategy):\n"
        "    def drive(self, route, view, stop_before): raise SystemExit(3)\n"
    )
    assert checks.check(["operator", f"{path}:Leaving"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert "SystemExit: 3 (leaving.py:3)" in lines[0]
    assert lines[-1] == "1 operator: 1 invalid"
