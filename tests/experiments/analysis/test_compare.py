"""Two results folders side by side: which cells and runs meet, and what is said of them."""

import math
from functools import cache

import numpy as np
import pytest
from helpers.studies.small_study import STUDY, cheap, run_study, study_in
from scipy import stats

from dva_sim.experiments.analysis.compare import Comparison
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ConfigError


def later(job):
    """Every drive takes 5 s more, and a second more for every person after the first."""
    tables = cheap(job)
    run = tables["runs"][0]
    run["drive_time_s"] += 5.0 + job.person
    return tables


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Makes results of the small study with some settings, each once."""

    @cache
    def make(*settings, episode=cheap, text=STUDY):
        folder = tmp_path_factory.mktemp("study")
        study = study_in(folder, *settings, text=text)
        return Results.load(run_study(study, folder / "out", jobs=1, episode=episode))

    return make


def levels_of(comparison):
    return [dict(pair.levels) for pair in comparison.matched.pairs]


def test_the_same_study_meets_itself_cell_by_cell_but_for_references(results):
    comparison = Comparison(results, results)
    assert len(comparison.matched.pairs) == 8
    assert all(pair.is_same for pair in comparison.matched.pairs)
    assert comparison.paired == (36, 36)
    assert comparison.changed() == ([], 5)
    assert all(row.is_identical for row in comparison.differences())


def test_a_difference_is_that_of_the_runs_with_the_same_random_numbers(made, results):
    rows = Comparison(results, made(episode=later)).differences("drive_time_s")
    drive = [row for row in rows if row.part == "drive"]
    assert len(drive) == 4
    for row in drive:
        assert row.is_paired
        assert row.runs == (6, 6)
        assert row.interval.mean == pytest.approx(5 + (0 + 1 + 2) / 3)
        assert row.interval.low < 6 < row.interval.high
        assert row.medians[1] - row.medians[0] == pytest.approx(6, abs=1.01)


def test_only_what_changed_is_named(made, results):
    assert Comparison(results, made(episode=later)).changed() == (["drive_time_s"], 5)


def test_other_persons_are_compared_as_such_by_welch(made, results):
    other = made("seed=4")
    comparison = Comparison(results, other)
    assert comparison.paired == (0, 36)
    row = comparison.differences("drive_time_s")[0]
    assert not row.is_paired
    cell = [
        runs["drive_time_s"][(runs["cell"] == 0) & (runs["part"] == "drive")]
        for runs in (results.runs, other.runs)
    ]
    means = [values.reshape(3, 2).mean(axis=1) for values in cell]
    reported = stats.ttest_ind(means[1], means[0], equal_var=False).confidence_interval(0.95)
    assert (row.interval.low, row.interval.high) == pytest.approx((reported.low, reported.high))


def test_cells_that_one_folder_alone_has_are_told(made, results):
    fewer = made("factors.link.delay_s=[0.25, 0.5]")
    matched = Comparison(results, fewer).matched
    assert {dict(pair.levels)["link.delay_s"] for pair in matched.pairs} == {0.25}
    assert {dict(levels)["link.delay_s"] for _, levels in matched.only_first} == {0.0}
    assert {dict(levels)["link.delay_s"] for _, levels in matched.only_second} == {0.5}


def test_a_factor_whose_levels_have_nothing_in_common_is_what_is_compared(made):
    sides = [made(f"factors.pattern=[{p}]") for p in ("req-rep", "latest-wins")]
    comparison = Comparison(*sides)
    assert comparison.matched.differing == {"pattern": (("req-rep",), ("latest-wins",))}
    assert levels_of(comparison)[:2] == [{"link.delay_s": 0}, {"link.delay_s": 0.25}]
    assert comparison.paired == (18, 18)
    assert not any(pair.is_same for pair in comparison.matched.pairs)


def test_a_single_cell_finds_its_like_in_a_grid_by_its_configuration(made, results):
    text = STUDY.replace("  pattern: [req-rep, latest-wins]\n", "").split("answer:")[0]
    alone = made("pattern=latest-wins", text=text)
    comparison = Comparison(results, alone)
    assert len(comparison.matched.pairs) == 4
    assert all(pair.is_same for pair in comparison.matched.pairs)


def test_folders_without_anything_in_common_are_refused(made, results):
    with pytest.raises(ConfigError, match="no configuration in common"):
        Comparison(results, made("factors.link.delay_s=[1]", "factors.pattern=[pub-sub]", "seed=9"))


def test_cells_can_be_taken_together_by_the_levels_of_a_factor(made, results):
    rows = Comparison(results, made(episode=later)).differences("drive_time_s", by=["pattern"])
    assert [(row.part, dict(row.levels), row.runs) for row in rows] == [
        ("drive", {"pattern": "req-rep"}, (12, 12)),
        ("drive", {"pattern": "latest-wins"}, (12, 12)),
        ("story", {"pattern": "req-rep"}, (6, 6)),
        ("story", {"pattern": "latest-wins"}, (6, 6)),
    ]


def test_a_measure_of_another_table_counts_by_runs(results):
    rows = Comparison(results, results).differences("tracks.x_m", by=["pattern"])
    assert [row.runs for row in rows if row.part == "drive"] == [(6, 6), (6, 6)]
    assert rows[0].medians[0] == pytest.approx((1 + 1 / 2 + 1 / 3) / 3)


def test_runs_without_a_value_take_no_part(results):
    rows = Comparison(results, results).differences("round_trip_s")
    odd = results.runs["seed"] % 2 == 1
    counted = np.isfinite(results.runs["round_trip_s"]) & (results.runs["cell"] >= 0)
    assert odd.any()
    assert sum(row.runs[0] for row in rows) == counted.sum()


def test_as_columns_it_names_its_units(results):
    frame = Comparison(results, results).frame("drive_time_s")
    assert frame.rows == 8
    assert frame["difference_drive_time_s"].tolist() == [0.0] * 8
    assert list(frame)[:3] == ["part", "pattern", "link.delay_s"]


def test_a_difference_of_one_person_has_no_interval(made):
    one = made("persons=1")
    row = Comparison(one, made("persons=1", episode=later)).differences()[0]
    assert row.interval.mean == pytest.approx(5.0)
    assert math.isnan(row.interval.low)
    assert not row.differs_from_zero


def test_where_random_numbers_are_shared_in_part_only_those_runs_are_looked_at(made, results):
    fewer = made("persons=2", episode=later)
    comparison = Comparison(results, fewer)
    assert comparison.paired == (24, 36)
    row = comparison.differences("drive_time_s")[0]
    assert row.runs == (4, 4)
    assert row.interval.mean == pytest.approx(5 + (0 + 1) / 2)
    runs = results.runs
    times = runs["drive_time_s"][
        (runs["cell"] >= 0) & (runs["person"] < 2) & (runs["part"] == "drive")
    ]
    assert comparison.judge("max(drive_time_s) > 1x")[0].first == times.max()
