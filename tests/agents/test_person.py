"""Simulated persons, and the populations that they are drawn from."""

import re
from dataclasses import asdict, fields

import numpy as np
import pytest

from dva_sim.agents.population import Person, Population, Trait, draw_person, median_person


def test_a_person_is_always_the_same_one_and_another_one_differs_in_every_trait():
    people = Population()
    assert draw_person(people, 1, 3) == draw_person(people, 1, 3)
    one, other = asdict(draw_person(people, 1, 3)), asdict(draw_person(people, 1, 4))
    assert [name for name in one if one[name] == other[name]] == ["habits"]


def test_the_fields_of_a_person_are_the_traits_of_a_population_in_their_order():
    names = [field.name for field in fields(Person) if not field.kw_only]
    traits = [re.sub(r"(_rad|_s|_m)+$", "", name) for name in Population().traits]
    assert names == traits


def test_persons_are_alike_in_all_but_the_trait_whose_median_is_changed():
    usual, fast = Population(), Population().with_medians({"crossover_rad_s": 3.0})
    for index in range(5):
        before, after = asdict(draw_person(usual, 1, index)), asdict(draw_person(fast, 1, index))
        assert after.pop("crossover") == pytest.approx(2.0 * before.pop("crossover"))
        assert after == before


def test_another_median_leaves_the_spread_and_the_population_as_they_were():
    people = Population(margin=Trait(median=0.5, spread=0.4))
    changed = people.with_medians({"margin": 0.8})
    assert changed.margin == Trait(median=0.8, spread=0.4)
    assert people.margin.median == 0.5
    margins = [draw_person(changed, 1, index).margin for index in range(400)]
    assert np.median(margins) == pytest.approx(0.8, rel=0.1)
    assert np.std(np.log(margins)) == pytest.approx(0.4, rel=0.1)


def test_no_median_changes_nothing():
    assert Population().with_medians({}) == Population()


def test_the_person_in_the_middle_has_every_trait_at_its_median():
    who = median_person(Population().with_medians({"margin": 0.7}))
    assert (who.margin, who.crossover, who.reaction) == (0.7, 1.5, 0.3)
    assert who.pace == 0.95
