"""Conditions that a comparison fails by: how they are read, and when they hold."""

import math

import numpy as np
import pytest
from helpers.studies.small_study import cheap, run_study, study_in

from dva_sim.experiments.analysis.compare import Comparison
from dva_sim.experiments.analysis.fail_conditions import Bound, judge, parse
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ConfigError


def later(job):
    """Drives of request/reply take 10 s more; every second round trip is gone."""
    tables = cheap(job)
    run = tables["runs"][0]
    run["drive_time_s"] += 10.0 * (job.levels.get("pattern") == "req-rep")
    run["round_trip_s"] = float("nan")
    return tables


@pytest.fixture(scope="module")
def beside(finished, tmp_path_factory):
    """The small study, and the same of other episodes."""

    def run(episode):
        folder = tmp_path_factory.mktemp("study")
        out = run_study(study_in(folder), folder / "out", jobs=1, episode=episode)
        return Results.load(finished), Results.load(out)

    return run


@pytest.fixture(scope="module")
def sides(beside):
    return beside(later)


@pytest.fixture(scope="module")
def comparison(sides):
    return Comparison(*sides)


# --- reading -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "bound"),
    [
        ("p95(response_s) > 1.05x", Bound(1.05, "times")),
        ("p95(response_s)>1.05 x", Bound(1.05, "times")),
        ("mean(response_s) > 3 s", Bound(3.0, "absolute")),
        ("mean(response_s) > 3", Bound(3.0, "absolute")),
        ("mean(response_s) > +500 ms", Bound(0.5, "more")),
        ("mean(response_s) < -0.5", Bound(-0.5, "more")),
        ("mean(events.response_s) > 2 min", Bound(120.0, "absolute")),
        ("share(confirmed) < 95 %", Bound(0.95, "absolute")),
        ("share(confirmed) < -2%", Bound(-0.02, "more")),
        ("max(jams) >= 1e2", Bound(100.0, "absolute")),
    ],
)
def test_a_bound_is_a_factor_a_difference_or_a_value_in_the_unit_of_the_measure(text, bound):
    assert parse(text).bound == bound


def test_a_condition_is_read_word_by_word():
    gate = parse("share(events.response_s > 60 s) per link.delay_s >= 1.5x")
    assert (gate.statistic, gate.measure, gate.per) == (
        "share",
        "events.response_s",
        "link.delay_s",
    )
    assert gate.test == (">", 60.0)
    assert gate.sign == ">="


@pytest.mark.parametrize("word", ["'gave up'", '"gave up"', "gave_up"])
def test_a_share_can_be_of_a_word(word):
    assert parse(f"share(outcome != {word}) < 1").test == ("!=", word.strip("'\""))


# --- judging -----------------------------------------------------------------------------------


def times(results, part, pattern=None):
    runs = results.runs
    chosen = (runs["part"] == part) & (runs["cell"] >= 0)
    if pattern is not None:
        chosen &= runs["pattern"] == pattern
    return runs["drive_time_s"][chosen]


@pytest.mark.parametrize(
    ("name", "statistic"),
    [
        ("mean", np.mean),
        ("median", np.median),
        ("min", np.min),
        ("max", np.max),
        ("p90", lambda values: np.percentile(values, 90)),
    ],
)
def test_statistics_are_over_all_runs_of_a_part(sides, comparison, name, statistic):
    verdicts = comparison.judge(f"{name}(drive_time_s) > 1x")
    assert [verdict.part for verdict in verdicts] == ["drive", "story"]
    for verdict in verdicts:
        assert verdict.first == pytest.approx(statistic(times(sides[0], verdict.part)))
        assert verdict.second == pytest.approx(statistic(times(sides[1], verdict.part)))


def test_a_group_of_cells_can_fail_where_the_whole_does_not(comparison):
    assert not any(v.holds for v in comparison.judge("mean(drive_time_s) > +6 s"))
    each = comparison.judge("mean(drive_time_s) per pattern > +6 s")
    assert {v.levels[0][1] for v in each if v.holds} == {"req-rep"}
    assert {v.levels[0][1] for v in each if not v.holds} == {"latest-wins"}
    condition = "mean(drive_time_s) per cell > +6 s"
    assert len(comparison.judge(condition)) == 8


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("mean(drive_time_s) > +4.9 s", True),  # 10 s in half of the cells
        ("mean(drive_time_s) > +5.1 s", False),
        ("mean(drive_time_s) >= 1x", True),
        ("mean(drive_time_s) < 1x", False),
        ("max(contacts) > 4", False),
        ("max(contacts) >= 4", True),
        ("share(confirmed) > +0", False),
        ("share(outcome == 'confirmed') < 1", False),  # of those that have an outcome
        ("missing(outcome) > 0", True),
    ],
)
def test_a_condition_holds_when_the_second_folder_is_beyond_its_bound(comparison, condition, holds):
    verdicts = judge(parse(condition), comparison)
    assert {verdict.holds for verdict in verdicts if verdict.part == "drive"} == {holds}


def test_a_share_of_values_beyond_a_bound(sides, comparison):
    limit = float(np.median(times(sides[0], "drive")))
    verdict = comparison.judge(f"share(drive_time_s > {limit!r}) > 50 %")[0]
    assert verdict.first == 0.5


def test_what_is_missing_is_told_beside_what_was_found(comparison):
    verdict = comparison.judge("missing(round_trip_s) > +0")[0]
    assert verdict.holds
    assert verdict.second == 1.0
    assert verdict.missing == (verdict.first, 1.0)


def crashes(job):
    """Run that never ends for the first person."""
    if job.person == 0:
        raise RuntimeError("fell")
    return cheap(job)


def never_arrives(job):
    """Run without a time for the first person, and a second longer for all others."""
    tables = cheap(job)
    run = tables["runs"][0]
    run["drive_time_s"] = math.nan if job.person == 0 else run["drive_time_s"] + 1.0
    return tables


def test_runs_that_crashed_in_the_second_folder_do_not_pass(beside):
    comparison = Comparison(*beside(crashes))
    with pytest.raises(ConfigError, match="drive 8 runs"):
        comparison.judge("p95(drive_time_s) > 1.05x")
    drive = comparison.judge("missing(drive_time_s) > 0 %")[0]
    assert (drive.first, drive.second, drive.holds) == (0.0, 1 / 3, True)


def test_pairs_with_a_value_on_both_sides_are_held_against_each_other(beside):
    comparison = Comparison(*beside(never_arrives))
    drive = comparison.judge("mean(drive_time_s) > +0.9 s")[0]
    assert drive.second - drive.first == pytest.approx(1.0)
    assert drive.missing == (0.0, 1 / 3)
    whole = comparison.judge("mean(drive_time_s) > 0 s")[0]
    assert whole.second == pytest.approx(drive.second)


def test_a_condition_on_values_that_one_folder_lacks_does_not_pass(comparison):
    with pytest.raises(ConfigError, match="second folder"):
        comparison.judge("mean(round_trip_s) > 1.05x")
