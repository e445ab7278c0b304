import itertools

import numpy as np
import pytest
from scipy import stats

from dva_sim.statistics import factorial_effects

PATTERNS, DELAYS, FILTERS = ["push", "pull"], [0.0, 0.5, 1.0], ["none", "median"]


def full_factorial(persons, outcome, rng, trials=2):
    """Rows of all combinations, as `(columns of levels, values, person)`."""
    rows = list(itertools.product(PATTERNS, DELAYS, FILTERS, range(persons), range(trials)))
    pattern, delay, used, person, _ = (np.array(column) for column in zip(*rows, strict=True))
    skill = rng.normal(0, 3, persons)[person]
    values = outcome(pattern, delay, used) + skill + rng.normal(0, 1, len(rows))
    return {"pattern": pattern, "delay": delay, "filter": used}, values, person


def law(pattern, delay, used):
    """4 s for each second of delay under push, 6 s more of them under pull; a filter costs 2 s."""
    return delay * np.where(pattern == "pull", 10.0, 4.0) + 2.0 * (used == "median")


def test_the_effects_that_were_put_in_come_out():
    found = factorial_effects(*full_factorial(40, law, np.random.default_rng(1)))
    by_name = {(e.factors, e.levels): e for e in found}
    expected = {
        (("pattern",), ("pull",)): 3.0,  # 6 s/s over a mean delay of 0.5 s
        (("delay",), (0.5,)): 3.5,
        (("delay",), (1.0,)): 7.0,
        (("filter",), ("median",)): 2.0,
        (("pattern", "delay"), ("pull", 0.5)): 3.0,
        (("pattern", "delay"), ("pull", 1.0)): 6.0,
        (("pattern", "filter"), ("pull", "median")): 0.0,
        (("delay", "filter"), (0.5, "median")): 0.0,
        (("delay", "filter"), (1.0, "median")): 0.0,
    }
    assert set(by_name) == set(expected)
    for name, size in expected.items():
        interval = by_name[name].interval
        assert interval.low <= size <= interval.high
        assert by_name[name].is_found == (size != 0)
        assert by_name[name].is_interaction == (len(name[0]) == 2)


def test_they_are_the_coefficients_of_least_squares_with_all_two_way_terms():
    levels, values, person = full_factorial(6, law, np.random.default_rng(2))
    found = factorial_effects(levels, values, person)
    coded = {  # each level's column sums to zero, so that main effects are averages
        "pattern": [(levels["pattern"] == "pull") - 1 / 2],
        "delay": [(levels["delay"] == d) - 1 / 3 for d in DELAYS[1:]],
        "filter": [(levels["filter"] == "median") - 1 / 2],
    }
    columns = [c for own in coded.values() for c in own]
    columns += [a * b for x, y in itertools.combinations(coded.values(), 2) for a in x for b in y]
    model = np.column_stack([np.ones(len(values)), *columns])
    fitted = np.linalg.lstsq(model, values)[0][1:]
    assert [e.interval.mean for e in found] == pytest.approx(fitted.tolist())


def test_a_two_level_effect_of_five_persons_alone_is_a_paired_t_test():
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 5))
    (found,) = factorial_effects({"x": ["a"] * 5 + ["b"] * 5}, [*a, *b], [*range(5), *range(5)])
    exact = stats.ttest_rel(b, a).confidence_interval(0.95)
    assert (found.interval.low, found.interval.high) == pytest.approx(tuple(exact))
    assert (found.levels, found.baselines) == (("b",), ("a",))


def test_no_effect_at_all_is_found_in_at_most_one_of_twenty_studies():
    rng = np.random.default_rng(4)
    alarms = []
    for _ in range(80):
        study = full_factorial(12, lambda pattern, delay, used: 0.0 * delay, rng, trials=1)
        alarms.append(any(e.is_found for e in factorial_effects(*study, resamples=500)))
    assert np.mean(alarms) <= 0.1


def test_a_person_with_an_empty_cell_is_left_out_of_what_needs_it():
    levels, values, person = full_factorial(8, law, np.random.default_rng(5))
    gone = (person == 3) & (levels["delay"] == 1.0)
    found = factorial_effects(levels, np.where(gone, np.nan, values), person)
    counts = {(e.factors, e.levels): e.interval.n_persons for e in found}
    assert counts[("delay",), (0.5,)] == 8
    assert counts[("delay",), (1.0,)] == 7
    assert counts[("pattern",), ("pull",)] == 7


def test_levels_taken_together_cannot_be_told_apart():
    levels = {"x": [0, 1, 0, 1], "y": [0, 1, 0, 1]}
    found = factorial_effects(levels, [1.0, 2.0, 3.0, 4.0], [0, 0, 1, 1])
    assert np.isnan([e.interval.mean for e in found]).all()
    assert not any(e.is_found for e in found)


def test_factors_with_a_single_level_have_no_effect():
    assert factorial_effects({"x": [1, 1]}, [1.0, 2.0], [0, 1]) == ()
