import numpy as np
import pytest
from helpers.wording import unnamed

from dva_sim.agents.operator.published import ranges
from dva_sim.experiments.analysis.robustness import support_of_part
from dva_sim.experiments.analysis.run_grid import Factor, RunGrid
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import cell_table

DELAY = Factor("link.delay_s", (0.0, 0.5, 5.0))
STRATEGY = Factor("operator.strategy", ("pursuit", "adaptive"))


def part_of(*, extra=(), human=0.3, waits=1.0):
    """A person and trial for each cell; the loop is twice the delay of the link and 0.1 s more.

    With delay, who steers adaptively moves and waits for a share of the time.
    """
    cells = [(delay, name) for delay in DELAY.levels for name in STRATEGY.levels]
    count = len(cells)
    delays = np.array([delay for delay, _ in cells])
    table = {
        "part": np.array(["drive"] * count),
        "is_reference": np.zeros(count, dtype=bool),
        "person": np.zeros(count, dtype=int),
        "trial": np.zeros(count, dtype=int),
        "seed": np.zeros(count, dtype=int),
        "link.delay_s": delays,
        "operator.strategy": np.array([name for _, name in cells]),
        "drive_time_s": 40 + delays,
        "loop_delay_mean_s": 2 * delays + 0.1 + human,
        "delay_human_s": np.full(count, human),
        "move_and_wait_share": np.array([waits * (d > 0 and n == "adaptive") for d, n in cells]),
    }
    return RunGrid(table | dict(extra), "drive", [DELAY, STRATEGY])


def test_the_loop_without_the_person_decides_not_the_link():
    found = support_of_part(part_of(human=0.3), {})
    np.testing.assert_allclose(found.delays[:, 0], [0.1, 1.1, 10.1])
    np.testing.assert_allclose(
        support_of_part(part_of(human=0.9), {}).delays, found.delays, atol=1e-12
    )


def test_a_loop_that_is_measured_in_two_legs_is_their_sum():
    part = part_of()
    legs = {"picture_age_mean_s": 1.0, "age_in_force_mean_s": 0.25}
    table = {name: column for name, column in part.treated.items() if "loop" not in name}
    two = table | {name: np.full(6, age) for name, age in legs.items()}
    found = support_of_part(RunGrid(two, "drive", part.factors), {})
    np.testing.assert_allclose(found.delays, 1.25)
    none = two | {"age_in_force_mean_s": np.array([0.05, 0.05, *[np.nan] * 4])}
    found = support_of_part(RunGrid(none, "drive", part.factors), {})
    assert found.outside[1:].all()
    assert support_of_part(RunGrid(table, "drive", part.factors), {}) is None


@pytest.mark.parametrize(("strategy", "is_outside"), [("adaptive", False), ("move_and_wait", True)])
def test_without_a_measured_share_the_strategy_decides_who_waits(strategy, is_outside):
    part = part_of()
    delays = {"loop_delay_mean_s": np.full(6, 0.1 + 0.3)}
    table = {name: column for name, column in part.treated.items() if "wait" not in name}
    one = RunGrid(table | delays, "drive", [DELAY])
    found = support_of_part(one, {"operator": {"strategy": strategy}})
    assert found.outside.tolist() == [is_outside] * 3


def test_each_strategy_has_the_support_of_its_own_data():
    assert ranges("pursuit")[-1][1] < 1.1 < ranges("adaptive")[-1][1]
    found = support_of_part(part_of(), {})
    assert found.outside.tolist() == [[False, False], [True, False], [True, True]]


@pytest.mark.parametrize(("waits", "is_outside"), [(1.0, False), (0.97, False), (0.55, True)])
def test_a_loop_closed_where_people_were_only_watched_waiting_is_an_extrapolation(
    waits, is_outside
):
    """At 1.1 s people moved and waited (Ferrell); nobody was watched steering by what it saw."""
    assert support_of_part(part_of(waits=waits), {}).outside[1, 1] == is_outside


def test_waiting_where_people_were_only_watched_steering_is_one_too():
    part = part_of(extra={"move_and_wait_share": np.tile([0.0, 0.5], 3)}.items())
    assert support_of_part(part, {}).outside[0].tolist() == [False, True]


def test_between_two_ranges_nobody_was_watched():
    shares = np.tile([0.0, 1.0], 3)
    delays = {"loop_delay_mean_s": np.repeat([0.5, 1.0, 1.4], 2) + 0.3}
    part = part_of(extra=(delays | {"move_and_wait_share": shares}).items())
    found = support_of_part(part, {})
    assert found.outside[:, 1].tolist() == [True, False, False]
    ranges_ = ("adaptive: 0 to 0.225 s", "pointing", "1 to 1.5 s", "move-and-wait")
    assert unnamed(found.words, *ranges_) == []


def test_a_strategy_that_no_data_speak_of_is_an_extrapolation_everywhere():
    part = part_of()
    one = RunGrid(part.treated, "drive", [DELAY])
    found = support_of_part(one, {"operator": {"strategy": "mine.py:Mine"}})
    assert found.outside.all()
    assert found.words.startswith("mine.py:Mine: ")


def test_nothing_is_said_where_nobody_drives():
    part = part_of(extra={"loop_delay_mean_s": np.full(6, np.nan)}.items())
    assert support_of_part(part, {}) is None


def test_the_table_marks_the_cells_and_explains_the_mark():
    part = part_of()
    table = cell_table(part, "drive_time_s", support=support_of_part(part, {}))
    assert [row[-1] for row in table.rows] == [
        *("0.10", "0.10"),
        *("1.1\N{NO-BREAK SPACE}†", "1.1"),
        *("10.1\N{NO-BREAK SPACE}†", "10.1\N{NO-BREAK SPACE}†"),
    ]
    assert unnamed(table.note, "† Extrapolated", "pursuit: 0 to 0.225 s") == []


@pytest.mark.parametrize(("panel", "stops"), [("pursuit", [1, 2]), ("adaptive", [2])])
def test_figures_hatch_the_stops_of_each_panel(panel, stops):
    part = part_of()
    outside = support_of_part(part, {}).outside
    view = StudyView(part, "drive_time_s", None, DELAY, None, {}, outside=outside)
    assert view.stops_outside({"operator.strategy": panel}) == stops
