"""Aimed movements of a person: where they end, what is foreseen, and when it waits."""

import math
from dataclasses import replace
from itertools import repeat

import pytest

from dva_sim.agents.operator.strategies.cursor import Sighting
from dva_sim.agents.operator.strategies.submovements import Submovements, foreseen, waited_share
from dva_sim.agents.population import Population, median_person

FRAME = 1.0 / 60.0  # [s]
MEDIAN = median_person(Population())


def seen(x, target=0.1, tolerance=0.005):
    return Sighting(
        tick=0,
        x=x,
        y=0.0,
        vx=0.0,
        vy=0.0,
        target_x=target,
        target_y=0.0,
        target_vx=0.0,
        target_vy=0.0,
        tolerance=tolerance,
    )


def moved(person, dead, seconds, noise=0.0):
    """Positions of a hand whose picture is late by `dead` [m]."""
    aims, place, speed = Submovements(person, most=2.0), 0.0, 0.0
    shown, late = [0.0] * (round(dead / FRAME) + 1), round(dead / FRAME)
    keep, delay = math.exp(-FRAME / person.hand_lag), dead + person.hand_lag
    for n in range(round(seconds / FRAME)):
        wanted, _ = aims.point(n * FRAME, seen(shown[-1 - late]), delay, repeat(noise))
        speed = wanted + (speed - wanted) * keep
        place += FRAME * speed
        shown.append(place)
    return place


def test_what_is_asked_for_twice_grows_with_the_part_of_a_new_delay_that_is_not_counted_on():
    """Before any picture shows more, who counts on all of the delay has asked for the way once."""
    sure, unsure = (replace(MEDIAN, compensates=c, waits_from=99.0) for c in (1.0, 0.1))
    dead = MEDIAN.usual_delay - MEDIAN.hand_lag + 0.5
    assert moved(sure, dead, seconds=dead) == pytest.approx(0.1, rel=0.1)
    assert moved(unsure, dead, seconds=dead) > 0.115


def test_a_delay_that_is_usual_is_counted_on_by_everybody():
    unsure = replace(MEDIAN, compensates=0.1)
    dead = MEDIAN.usual_delay - MEDIAN.hand_lag
    assert moved(unsure, dead, seconds=dead + 1.0) == pytest.approx(0.1, abs=0.006)


def test_a_target_is_foreseen_to_turn_back_at_the_edge():
    assert foreseen(0.1, 0.2, 0.5, edge=0.15) == pytest.approx((0.1, -0.2))
    assert foreseen(-0.1, -0.2, 0.5, edge=0.15) == pytest.approx((-0.1, 0.2))
    assert foreseen(0.1, 0.2, 0.1, edge=math.inf) == pytest.approx((0.12, 0.2))


def test_waiting_is_rare_at_short_delays_and_usual_at_long_ones():
    shares = [waited_share(delay, 0.7) for delay in (0.0, 0.2, 0.7, 1.5)]
    assert shares == sorted(shares)
    assert shares[1] < 0.01
    assert shares[2] == pytest.approx(0.5)
    assert shares[3] > 0.98
