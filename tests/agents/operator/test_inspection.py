"""Confirming, refuting and giving up, by pictures that a test makes up."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from helpers.worlds.delayed_loops import normals

from dva_sim.agents.observation import CLEAR, Observation, SeenHazard
from dva_sim.agents.operator.inspection import Looking
from dva_sim.agents.population import Population, median_person
from dva_sim.worlds.planning import Planner

PLACE = (10.0, 5.0)
PERSON = median_person(Population())
FIRE = SeenHazard("fire", *PLACE, 1.2, 0.8, 1.0)
LEAK_IN_SMOKE = SeenHazard("gas_leak", *PLACE, 1.2, 0.8, 0.06)


class OpenGround(Planner):
    """No walls at all."""

    def __init__(self) -> None: ...

    def line_of_sight(self, a: tuple[float, float], b: tuple[float, float]) -> bool:
        return True


def looker(
    kind: str = "fire",
    seed: int = 1,
    arrived: Callable[[], object] = lambda: None,
    **traits: float,
) -> Looking:
    """The median person, with some traits otherwise, who looks for an event at the place."""
    person, noise = replace(PERSON, **traits), normals(seed)
    return Looking(kind, PLACE, planner=OpenGround(), person=person, normals=noise, arrived=arrived)


def picture(*hazards: SeenHazard, away: float = 1.2, visibility: float = CLEAR) -> Observation:
    """From so far before the place [m]."""
    return Observation(0, PLACE[0] - away, PLACE[1], 0.0, 0.0, 0.0, hazards, visibility)


def look_at(
    seen: Observation, seed: int = 1, kind: str = "fire", rate: float = 10.0, **traits: float
) -> tuple[tuple[str, str] | None, float]:
    """Look at the same picture for up to 400 s: the outcome, and when [s]."""
    looking = looker(kind, seed, **traits)
    for number in range(1, int(400 * rate)):
        found = looking.look(number / rate, seen)
        if found is not None:
            return found, number / rate
    return None, math.inf


def outcomes(seen: Observation, count: int = 200, **how: float) -> list[str]:
    return [found[0] for seed in range(count) if (found := look_at(seen, seed, **how)[0])]


def test_an_event_in_plain_view_is_confirmed_and_an_empty_place_refuted_after_25_s():
    assert look_at(picture(FIRE))[0] == ("confirmed", "")
    assert look_at(picture()) == (("refuted", "nothing there"), pytest.approx(25.2, abs=0.11))


def test_with_everything_good_nobody_of_500_is_wrong():
    assert set(outcomes(picture(FIRE), 500)) == {"confirmed"}
    assert set(outcomes(picture(), 500)) == {"refuted"}


def test_from_elsewhere_nothing_is_refuted():
    assert look_at(picture(away=3.0))[0] is None


@pytest.mark.parametrize("visibility", [0.01, 0.4, 1.0, 1.19])
def test_who_cannot_see_the_place_gives_up_and_refutes_nothing(visibility):
    for seed in range(20):
        found, when = look_at(picture(visibility=visibility), seed, kind="gas_leak")
        assert found == ("gave up", "nothing can be seen")
        assert when == pytest.approx(PERSON.patience, abs=0.3)


def test_who_cannot_see_the_place_wants_to_look_from_nearer_after_5_s():
    looking = looker("gas_leak")
    wants = [
        looking.wants_nearer
        for number in range(80)
        if looking.look(number / 10, picture(visibility=0.8)) is None
    ]
    assert wants.index(True) / 10 == pytest.approx(5.2, abs=0.11)
    assert wants[-1]


def test_from_nearer_the_same_smoke_lets_the_place_be_seen():
    """Through 0.8 m one sees to the place from 0.5 m, not from 1.2 m."""
    assert set(outcomes(picture(away=1.2, visibility=0.8), 20)) == {"gave up"}
    assert "gave up" not in outcomes(picture(away=0.5, visibility=0.8), 20)


def test_misses_come_with_smoke_few_frames_and_haste():
    """A leak behind smoke that leaves 6 % of its contrast, hard to tell within 25 s."""
    missed = {
        name: np.mean([out == "refuted" for out in outcomes(seen, 200, **how)])
        for name, seen, how in (
            ("clear", picture(replace_contrast(1.0)), {}),
            ("smoke", picture(LEAK_IN_SMOKE, visibility=1.3), {}),
            ("few frames", picture(replace_contrast(1.0)), {"rate": 0.1}),
            ("haste", picture(LEAK_IN_SMOKE, visibility=1.3), {"search": 8.0}),
        )
        for how in [{"kind": "gas_leak", **how}]
    }
    assert missed["clear"] == 0.0
    assert missed["smoke"] > 0.3
    assert missed["few frames"] > 0.1
    assert missed["haste"] > missed["smoke"]


def replace_contrast(contrast: float) -> SeenHazard:
    return LEAK_IN_SMOKE._replace(contrast=contrast)


def test_false_confirmations_come_with_haste_and_smoke():
    hasty = {"confirm_look": 0.7}
    false = [
        np.mean([out == "confirmed" for out in outcomes(seen, 200, **how)])
        for seen, how in ((picture(), {}), (picture(), hasty), (picture(visibility=4.0), hasty))
    ]
    assert false[0] == 0.0
    assert 0.02 < false[1] < false[2]


def test_while_the_person_looks_away_no_time_counts():
    looking = looker()
    for number in range(40):  # a glance of a second every ten seconds
        for step in range(10):
            assert looking.look(10.0 * number + step / 10, picture()) is None or number >= 25
        looking.look_away()


def test_a_place_is_arrived_at_once():
    calls: list[int] = []
    looking = looker(arrived=lambda: calls.append(1))
    for number in range(20):
        looking.look(number / 10, picture(FIRE))
    assert calls == [1]
