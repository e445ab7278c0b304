"""Promises of hazards: kept by the shipped ones, missed by the bad ones."""

import itertools
import math
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest
from helpers.wording import unnamed

from dva_sim.cli import checks
from dva_sim.testing.hazards import check_hazard
from dva_sim.testing.promises import tried
from dva_sim.worlds.hazards import CLEAR, Conditions, Hazard, HazardField, make_hazard
from dva_sim.worlds.hazards.detectors import DetectorAlarm

EXAMPLE = "steam_leak.py:SteamLeak"


@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        ("fire", {"growth": "ultrafast"}),
        ("gas_leak", {"gas": "carbon_monoxide"}),
        ("flood", {}),
        (EXAMPLE, {}),
    ],
)
def test_every_hazard_that_is_shipped_keeps_its_promises(fewer, kind, settings):
    outcome = tried(
        check_hazard, lambda at, start: make_hazard(kind, at, start, **settings), slow=60.0
    )
    assert (outcome.broken, outcome.warnings) == ((), ())


class Warmth(HazardField):
    """Warm air within two metres."""

    def at(self, x, y, time):
        if not self.hazard.start < time < self.until:
            return CLEAR
        near = math.dist(self.hazard.position, (x, y)) < 2.0
        return Conditions(20.0 + self.hazard.radius(time)) if near else CLEAR


class Good(Hazard):
    reported_as = "fire"
    title = "warm spot"
    detectors = ("heat",)
    made: ClassVar[type[HazardField]] = Warmth

    def radius(self, time):
        return min(1.0, 0.01 * max(0.0, time - self.start))

    def danger_radius(self, time):
        return self.radius(time)

    def severity(self, time):
        return self.radius(time)

    def field(self, site):
        return self.made(self, site)


class Anywhere(Good):
    def __init__(self, position, start, **settings):
        super().__init__((0.0, 0.0), start, **settings)


rng = np.random.default_rng(1)


def but(**changed: Any) -> type[Hazard]:
    """A hazard that is good but for this."""
    changed |= {"__module__": __name__, "__qualname__": "Bad"}
    return type(Good)("Bad", (Good,), changed)


def severe(severity: Callable[[float], float]) -> type[Hazard]:
    """One whose severity depends on the time since a second after it began, and now."""
    return but(severity=lambda self, time: severity(time) if time > self.start + 1.0 else 0.0)


class Field(Warmth):
    answer: ClassVar = Conditions(30.0)

    def at(self, x, y, time):
        return self.air(time) if self.is_near(x, y, time) else CLEAR

    def air(self, time):
        return self.answer

    def is_near(self, x, y, time):
        near = math.dist(self.hazard.position, (x, y)) < 2.5
        return near and self.hazard.start < time < self.until


class Counting(Field):
    def __init__(self, *given):
        super().__init__(*given)
        self.count = itertools.count()

    def air(self, time):
        return Conditions(21.0 + next(self.count))


def of(**changed: Any) -> type[Hazard]:
    """A hazard whose field is such a one, but for this."""
    return but(made=type("Made", (Field,), changed))


def burst(self: Field, *_: float) -> Conditions:
    raise ZeroDivisionError("no air")


def test_the_hazard_that_the_faulty_ones_are_made_from_keeps_its_promises(fewer):
    assert tried(check_hazard, Good, slow=60.0).broken == ()


def is_on(self: Field, _x: float, _y: float, time: float) -> bool:
    return bool(self.hazard.start < time < self.until)


def is_close(self: Field, x: float, y: float, _time: float) -> bool:
    return math.dist(self.hazard.position, (x, y)) < 2.5


def dense(self: Field, what: str, places: Any, time: float) -> Any:
    return np.full(places.spaces.shape, -1.0)


EARLY = DetectorAlarm(lambda age, dt: False, at_latest=-20.0)


@pytest.mark.parametrize(
    ("kind", "problem"),
    [
        (but(title=""), "no title"),
        (Anywhere, "where or when it was put"),
        (but(severity=lambda self, time: -0.5), "severity that is none: -0.5"),
        (but(radius=lambda self, time: 1.0), "radius before it begins"),
        (but(severity=lambda self, time: float(time > self.start)), "severity from nothing"),
        (severe(lambda time: min(1.0, time / 1e4)), "when it begins later: severity"),
        (severe(lambda time: rng.uniform()), "in another order, or at random: severity"),
        (of(answer=Conditions(math.nan)), "temperature that is none: nan"),
        (of(answer=Conditions(-30.0)), "temperature that is none: -30"),
        (of(is_near=is_on), "the air ten kilometres away"),
        (of(is_near=is_close), "the air before it begins"),
        (but(made=Counting), "in another order: asked in a random order"),
        (of(air=lambda self, time: Conditions(21.0 + rng.uniform())), "random numbers, or shares"),
        (of(air=lambda self, now: Conditions(21.0 + min(now, 2e3))), "begins later: the air"),
        (of(air=lambda self, _: Conditions(30.0 + (self.until < math.inf))), "before its source"),
        (of(answer=Conditions(extinction=1.0)), "not hazy where light is lost"),
        (of(picture=dense), "picture with values that are none"),
        (of(picture=lambda self, what, places, time: np.zeros((2, 2))), "of another shape"),
        (of(alarm=lambda *_: EARLY), "noticed before it begins: heat, 30 s"),
        (but(detectors=("dog",)), "does not exist: 'dog'"),
        (of(at=burst), "raises: ZeroDivisionError: no air"),
    ],
)
def test_a_faulty_hazard_is_found_out(fewer, kind, problem):
    broken = tried(check_hazard, kind, slow=60.0).broken
    assert any(problem in line for line in broken), broken


def test_a_slow_hazard_and_one_that_nothing_notices_earn_warnings():
    slow, unnoticed = tried(check_hazard, but(detectors=()), slow=0.0).warnings[::2]
    assert slow.startswith("is slow")
    assert not unnamed(unnoticed, "no detector")


def test_check_hazard_tries_one_by_name_with_options(capsys):
    assert checks.check(["hazard", EXAMPLE], ["hole_mm=5"]) == 0
    assert checks.check(["hazard", EXAMPLE], ["hole_mm=0"]) != 0
    assert not unnamed(capsys.readouterr().out, "hole_mm", "above 0", "not 0")
