import itertools

import numpy as np
import pytest

from dva_sim.experiments.analysis.run_grid import Factor, RunGrid, as_floats, codes_of, person_means
from dva_sim.experiments.analysis.study_view import StudyView

PATTERN = Factor("pattern", ("req-rep", "latest-wins"))
DELAY = Factor("link.delay_s", (0, 0.5))


def table(rows):
    return {key: np.array([row[key] for row in rows], dtype=object) for key in rows[0]} | {
        key: np.array([row[key] for row in rows]) for key in ("person", "trial", "is_reference")
    }


def rows(persons=3, trials=2):
    """Reference 10 + person; treated 1 s more, 2 s more at 0.5 s, 4 s more with req-rep."""
    found = []
    for person, trial in itertools.product(range(persons), range(trials)):
        base = {"part": "drive", "person": person, "trial": trial, "confirmed": True}
        reference = {"is_reference": True, "pattern": None, "link.delay_s": None}
        found.append(base | reference | {"drive_time_s": 10.0 + person})
        for pattern, delay in itertools.product(PATTERN.levels, DELAY.levels):
            time = 11.0 + person + 4 * delay + 4 * (pattern == "req-rep")
            cell = {"is_reference": False, "pattern": pattern, "link.delay_s": delay}
            found.append(base | cell | {"drive_time_s": time})
    return found


def view(part, contrast=("req-rep", "latest-wins")):
    return StudyView(part, "drive_time_s", PATTERN, DELAY, contrast, {})


def test_excess_is_taken_from_the_reference_of_the_same_person_and_trial():
    part = RunGrid(table(rows()), "drive", [PATTERN, DELAY])
    excess = part.excess("drive_time_s")
    assert excess.shape == (2, 2, 3, 2)
    np.testing.assert_allclose(part.where(excess, {"pattern": "latest-wins"})[0], 1.0)
    np.testing.assert_allclose(part.where(excess, {"pattern": "req-rep"})[1], 7.0)


def test_differences_are_paired_whatever_the_order_of_the_rows():
    shuffled = rows()
    np.random.default_rng(3).shuffle(shuffled)
    part = RunGrid(table(shuffled), "drive", [PATTERN, DELAY])
    difference = view(part).difference({}, "req-rep", "latest-wins")
    np.testing.assert_allclose(difference, np.full((3, 2), 4.0))


def test_a_missing_run_takes_its_pair_with_it_and_no_other():
    there = [
        r
        for r in rows()
        if not (r["person"] == 0 and r["pattern"] == "req-rep" and r["link.delay_s"] == 0.5)
    ]
    difference = view(RunGrid(table(there), "drive", [PATTERN, DELAY])).difference(
        {}, "req-rep", "latest-wins"
    )
    assert np.isnan(difference[0, 1])
    assert np.isfinite(difference).sum() == 5


def test_a_study_without_a_reference_is_judged_by_the_measure_itself():
    there = [r for r in rows() if not r["is_reference"]]
    part = RunGrid(table(there), "drive", [PATTERN, DELAY])
    assert not part.has_reference("drive_time_s")
    assert view(part).values[1, 0, 2, 0] == pytest.approx(13.0)


def test_factors_that_are_not_lines_or_along_x_become_panels_the_answers_first():
    part = RunGrid(table(rows()), "drive", [PATTERN, DELAY])
    seen = StudyView(part, "drive_time_s", None, DELAY, None, {"pattern": "latest-wins"})
    assert seen.panels == [{"pattern": "latest-wins"}, {"pattern": "req-rep"}]


@pytest.mark.parametrize("column", [[np.nan, 8192.0, np.nan], [None, 8192, None]])
def test_nothing_is_a_level_whether_it_is_read_as_nothing_or_as_no_number(column):
    values = {"buffer": np.array(column, dtype=object)} | {
        "numbers": np.array([np.nan if v is None else v for v in column])
    }
    for name in values:
        assert codes_of(values, Factor(name, (None, 8192))).tolist() == [0, 1, 0]
        assert codes_of(values, Factor(name, (4096, 8192))).tolist() == [-1, 1, -1]


def test_true_is_one_and_what_is_not_a_number_is_missing():
    column = np.array([True, None, 2, "word"], dtype=object)
    np.testing.assert_array_equal(as_floats(column), [1.0, np.nan, 2.0, np.nan])


def test_person_means_leave_missing_trials_out():
    values = np.array([[[1.0, 3.0], [np.nan, 5.0], [np.nan, np.nan]]])
    np.testing.assert_array_equal(person_means(values), [[2.0], [5.0], [np.nan]])
