"""What every hazard promises: kept by all that are shipped, missed by the bad ones."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from dva_sim.cli import checks
from dva_sim.kernel.errors import ConfigError
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
def test_every_hazard_that_is_shipped_keeps_its_promises(kind: str, settings: dict) -> None:
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


class Nameless(Good):
    title = ""


class Anywhere(Good):
    def __init__(self, position, start, **settings):
        super().__init__((0.0, 0.0), start, **settings)


class Backwards(Good):
    def severity(self, time):
        return -0.5


class Early(Good):
    def radius(self, time):
        return 1.0


class Sudden(Good):
    def severity(self, time):
        return 1.0 if time > self.start else 0.0


class ByTheClock(Good):
    def severity(self, time):
        return min(1.0, time / 1e4) if time > self.start + 1.0 else 0.0


class ByChance(Good):
    luck: ClassVar = np.random.default_rng(1)

    def severity(self, time):
        return self.luck.uniform() if time > self.start + 1.0 else 0.0


class Field(Warmth):
    answer: ClassVar = Conditions(30.0)

    def at(self, x, y, time):
        return super().at(x, y, time) and self.answer if self.is_near(x, y, time) else CLEAR

    def is_near(self, x, y, time):
        near = math.dist(self.hazard.position, (x, y)) < 2.5
        return near and self.hazard.start < time < self.until


class Hot(Field):
    answer = Conditions(math.nan)


class Cold(Field):
    answer = Conditions(-30.0)


class Everywhere(Field):
    def is_near(self, x, y, time):
        return self.hazard.start < time < self.until


class Always(Field):
    def is_near(self, x, y, time):
        return math.dist(self.hazard.position, (x, y)) < 2.5


class Counting(Field):
    def __init__(self, *given):
        super().__init__(*given)
        self.count = itertools.count()

    def at(self, x, y, time):
        return Conditions(21.0 + next(self.count)) if self.is_near(x, y, time) else CLEAR


class Chancy(Field):
    luck: ClassVar = np.random.default_rng(1)

    def at(self, x, y, time):
        return Conditions(21.0 + self.luck.uniform()) if self.is_near(x, y, time) else CLEAR


class Dated(Field):
    def at(self, x, y, time):
        return Conditions(21.0 + time) if self.is_near(x, y, time) and time < 2e3 else CLEAR


class Foreknowing(Field):
    def at(self, x, y, time):
        warm = 30.0 if self.until == math.inf else 40.0
        return Conditions(warm) if self.is_near(x, y, time) else CLEAR


class Fog(Field):
    """Light is lost, and nobody said so."""

    answer = Conditions(extinction=1.0)


class Pictured(Field):
    def picture(self, what, places, time):
        return np.full(places.spaces.shape, -1.0)


class Drawn(Field):
    def picture(self, what, places, time):
        return np.zeros((2, 2))


class Rings(Field):
    def alarm(self, detector, x, y):
        return DetectorAlarm(lambda age, dt: False, at_latest=-20.0)


class Deadly(Field):
    answer = Conditions(co=1e5)

    def at(self, x, y, time):
        raise ZeroDivisionError("no air")


def of(field: type[HazardField]) -> type[Hazard]:
    class Kind(Good):
        made: ClassVar = field

    return Kind


class Sniffed(Good):
    detectors = ("dog",)


def test_the_hazard_that_the_faulty_ones_are_made_from_keeps_its_promises() -> None:
    assert tried(check_hazard, Good, slow=60.0).broken == ()


@pytest.mark.parametrize(
    ("kind", "problem"),
    [
        (Nameless, "has no title"),
        (Anywhere, "is not where or when it was put"),
        (Backwards, "has a severity that is none: -0.5"),
        (Early, "has a radius before it begins"),
        (Sudden, "does not grow its severity from nothing"),
        (ByTheClock, "goes otherwise when it begins later: severity"),
        (ByChance, "answers differently in another order, or at random: severity"),
        (of(Hot), "makes air with a temperature that is none: nan"),
        (of(Cold), "makes air with a temperature that is none: -30"),
        (of(Everywhere), "changes the air ten kilometres away"),
        (of(Always), "changes the air before it begins"),
        (of(Counting), "answers differently in another order: asked in a random order"),
        (of(Chancy), "draws random numbers, or shares memory"),
        (of(Dated), "goes otherwise when it begins later: the air"),
        (of(Foreknowing), "is changed before its source is stopped"),
        (of(Fog), "is not hazy where light is lost"),
        (of(Pictured), "has a picture with values that are none"),
        (of(Drawn), "has a picture of another shape"),
        (of(Rings), "is noticed before it begins: heat, 30 s"),
        (Sniffed, "is noticed by what does not exist: 'dog'"),
        (of(Deadly), "raises: ZeroDivisionError: no air"),
    ],
)
def test_a_faulty_hazard_is_found_out(kind: type[Hazard], problem: str) -> None:
    broken = tried(check_hazard, kind, slow=60.0).broken
    assert any(line.startswith(problem) for line in broken), broken


def test_a_slow_hazard_and_one_that_nothing_notices_earn_warnings() -> None:
    class Unnoticed(Good):
        detectors = ()

    slow, unnoticed = tried(check_hazard, Unnoticed, slow=0.0).warnings[::2]
    assert slow.startswith("is slow")
    assert unnoticed.startswith("is noticed by no detector")


@pytest.mark.parametrize(
    "words", ['reported_as = "quake"', 'reported_as, shows = "fire", ("dust",)']
)
def test_a_class_that_nobody_could_be_told_of_is_refused_when_it_is_made(
    words: str, tmp_path: Path
) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "from dva_sim.worlds.hazards import Hazard\n"
        f"class Mine(Hazard):\n    {words}\n    def field(self, site): ...\n"
    )
    with pytest.raises(ConfigError, match="of Mine should be") as found:
        make_hazard(f"{file}:Mine", (0.0, 0.0), 0.0)
    assert found.value.file == str(file)


def test_check_hazard_tries_one_by_name_with_options(capsys) -> None:
    assert checks.check(["hazard", EXAMPLE], ["hole_mm=5"]) == 0
    assert "steam_leak.py:SteamLeak: hazard: valid" in capsys.readouterr().out
    assert checks.check(["hazard", EXAMPLE], ["hole_mm=0"]) != 0
    assert "hole_mm: should be above 0, not 0" in capsys.readouterr().out
