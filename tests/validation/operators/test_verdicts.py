"""Verdicts, the rule, and the aggregation of trials, on numbers that can be worked out by hand."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.wording import unnamed

from dva_sim.agents.operator.published import load_split, load_targets, target_lines
from dva_sim.validation.evidence import headline, passes
from dva_sim.validation.operators import experiments as of
from dva_sim.validation.operators.evidence import GROUPS, judge, rule_of, steered
from dva_sim.validation.operators.trials import (
    LineValue,
    Trials,
    certain,
    collect,
    mean,
    with_intervals,
)

LINES = {line.id: line for line in target_lines(load_targets(), load_split())}
RULE = load_split().rule


def middle(line):
    """A value that passes in a line with two ends."""
    return certain(0.5 * (line.low + line.high))


def verdict(line, value):
    return judge([line], {line.id: certain(value)})[0]


def rule(lines, values):
    """The rule on some lines, by the line's name."""
    return {line.line: line for line in rule_of(lines, judge(lines, values), RULE, {})}


def trials(person=(0, 1), **columns):
    arrays = {name: np.array(values, float) for name, values in columns.items()}
    return Trials(np.array(person), arrays)


def timed(*times):
    return trials(person=range(len(times)), movement_time_s=times)


def test_a_value_in_its_band_passes_and_one_beyond_it_misses():
    line = LINES["S17/increase"]
    assert verdict(line, 0.39).verdict == verdict(line, 0.59).verdict == "holds"
    assert verdict(line, 0.60).verdict == "misses"


def test_a_target_changed_to_a_wrong_number_makes_the_verdict_a_miss():
    wrong = replace(LINES["S16/slow"], target=500.0, low=495.0, high=505.0)
    assert verdict(LINES["S16/slow"], 600.0).verdict == "holds"
    assert verdict(wrong, 600.0).verdict == "misses"


@pytest.mark.parametrize(("line", "sign"), [("S12/less", -1), ("S12/more", 1), ("S7/25", 1)])
def test_where_the_sign_counts_no_effect_misses_and_so_does_an_interval_that_holds_none(line, sign):
    for value, other_end, word in ((0.0, 0.0, "misses"), (2, -1, "misses"), (2, 1, "holds")):
        ends = sorted(1 + 0.01 * sign * share for share in (other_end, 3))
        found = LineValue(1 + 0.01 * sign * value, *ends, 24)
        assert judge([LINES[line]], {line: found})[0].verdict == word


def test_a_line_beside_the_others_is_shown_without_a_band():
    shown = verdict(LINES["S7/time-25"], 2000.0)
    assert shown.words[2:] == ("934", "2000", "–", "shown only: no band")


def test_a_publication_passes_as_a_whole_if_all_its_lines_do():
    not_fitted = [line for line in LINES.values() if line.kind == "not-fitted"]
    values = {line.id: middle(line) for line in not_fitted}
    assert rule(not_fitted, values)["publications not fitted to"].note == "9 of 9"
    values["S8/slope"] = values["S7/75"] = certain(0.0)  # both of one publication
    assert rule(not_fitted, values)["publications not fitted to"].note == "8 of 9"


@pytest.mark.parametrize("line", ["S9/dwell", "S14/crossover"])
def test_what_was_fitted_to_or_remembered_is_shown_only_wherever_it_lies(line):
    assert verdict(LINES[line], 1.2).verdict == verdict(LINES[line], 99.0).verdict == "shown only"
    assert verdict(LINES[line], 1.2).note == "inside its band"
    assert verdict(LINES[line], 99.0).note == "outside its band"


def test_what_was_not_simulated_misses():
    (missing,) = judge([LINES["S1/critical"]], {})
    assert missing.verdict == "misses"


@pytest.mark.parametrize(("misses", "holds"), [(0, True), (3, True), (4, False)])
def test_four_of_five_not_fitted_lines_are_enough(misses, holds):
    not_fitted = [line for line in LINES.values() if line.kind == "not-fitted"]
    values = {line.id: middle(line) for line in not_fitted}
    values |= {line.id: certain(-99.0) for line in not_fitted[:misses]}
    lines = rule(not_fitted, values)
    assert lines["lines not fitted to"].note == f"{19 - misses} of 19"
    assert passes(lines.values()) == holds


def test_what_judges_nothing_does_not_pass():
    assert not passes(rule_of([], [], RULE, {}))


def test_a_single_exact_line_that_misses_fails_it_all():
    exact = [line for line in LINES.values() if line.kind == "exact"]
    values = {line.id: certain(line.high if line.low is None else line.low) for line in exact}
    assert passes(rule(exact, values).values())
    values["S16/slow"] = certain(650.0)
    assert not passes(rule(exact, values).values())


def test_the_headline_names_every_miss_and_what_the_rule_asks_for():
    not_fitted = [line for line in LINES.values() if line.kind == "not-fitted"]
    verdicts = judge(not_fitted, {line.id: certain(-9.0) for line in not_fitted})
    text = headline([*verdicts, *rule_of(not_fitted, verdicts, RULE, {})])
    assert text.startswith("0 of 19 ")
    assert not unnamed(text, *(line.id for line in not_fitted), "(0, 0 of 19;", " 0.8)")


def test_words_give_target_band_and_unit():
    assert verdict(LINES["S9/dwell"], 1.3).words[2:5] == ("1.2", "1.3", "0.95 to 1.45")
    assert verdict(LINES["S16c/30"], math.inf).words[1:5] == (
        *("30 ppm, not before [min]", "–", "∞", "at least 120"),
    )
    assert verdict(LINES["S16c/300"], 2.0).words[4] == "at most 3"
    assert verdict(LINES["S12/less"], 0.9).note == "surely below 1"


def test_a_value_at_the_edge_of_what_was_tried_says_so():
    line = LINES["S15/c"]
    assert "at the edge" in verdict(line, 6.0).note
    assert "at the edge" not in verdict(line, 2.0).note


def test_fires_and_people_on_foot_stand_under_a_heading_of_their_own():
    groups = [v.group for v in judge(list(LINES.values()), {})]
    counts = [groups.count(GROUPS["exact", is_standard]) for is_standard in (False, True)]
    assert counts == [9, 19]


def test_how_they_steered_is_told_cell_by_cell_where_it_differs():
    lag = {name: trials(move_and_wait_share=(0, 0)) for name in ("8.3", "25")}
    reach = {"0": lag["25"], "1.5": trials(move_and_wait_share=(0.5, 1.0))}
    reported = steered({"steering": lag, "excavator": reach})
    assert [(name, re.findall(r"[\d.]+", shares)) for name, shares in reported] == [
        ("steering", ["0"]),
        ("excavator, by delay [s]", ["0", "0", "1.5", "75"]),
    ]


def test_a_mean_is_over_persons_however_many_trials_they_have_and_leaves_out_what_is_no_number():
    assert mean(trials(person=(0, 0, 0, 1), movement_time_s=(1, 1, 1, 3)), _T) == 2.0
    assert mean(trials(movement_time_s=(2.0, math.nan)), _T) == 2.0


def test_rows_become_columns_of_their_numbers():
    rows = [(3, [{"a": 1, "b": "word"}, {"a": None, "b": "word"}]), (5, [{"a": 2.5, "b": "w"}])]
    found = collect(rows)
    assert found.person.tolist() == [3, 3, 5]
    assert found["a"][[0, 2]].tolist() == [1.0, 2.5]
    assert math.isnan(found["a"][1])
    assert "b" not in found.columns


def test_an_interval_spans_what_other_persons_would_give():
    cells = {"one": timed(*range(100))}
    measure = lambda cells: {"m": mean(cells["one"], _T)}  # noqa: E731
    found = with_intervals(measure, cells, np.random.default_rng(1))["m"]
    assert found.value == 49.5
    assert found.high - found.low == pytest.approx(2 * 1.96 * 28.87 / 10, rel=0.1)


def test_persons_are_drawn_with_all_their_trials_in_every_cell():
    same = trials(person=(0, 0, 1, 1), movement_time_s=(1, 2, 5, 9))
    cells = {"a": same, "b": same}
    ratio = lambda c: {"r": mean(c["a"], _T) / mean(c["b"], _T)}  # noqa: E731
    found = with_intervals(ratio, cells, np.random.default_rng(1))["r"]
    assert found.low == found.high == 1.0


_T = "movement_time_s"


def test_the_slope_on_lag_is_that_of_the_publications_model():
    """MT = 0.2 + (0.15 + 0.001 LAG) ID: at 4 bits a millisecond costs 4 ms."""
    bits = np.array([2.0, 3.0, 4.0, 5.0])
    cells = {
        lag: trials(
            person=[0] * 4, id_bits=bits, movement_time_s=0.2 + (0.15 + 0.001 * float(lag)) * bits
        )
        for lag in of.LAGS_S
    }
    assert of.lag_slope(cells) == pytest.approx(4.0)
    assert of.lag_values(cells)["S7/75"] == pytest.approx(
        (0.2 + 0.225 * 3.5) / (0.2 + 0.1583 * 3.5)
    )


def test_throughput_is_the_mean_over_persons_and_conditions():
    own = trials(person=(0, 1, 0, 1), id_bits=(2, 2, 3, 3), movement_time_s=(1, 2, 1, 3))
    assert of.throughput(own) == pytest.approx((2 / 1 + 2 / 2 + 3 / 1 + 3 / 3) / 4)


def test_a_slope_of_three_seconds_a_second_agrees_with_three_waits():
    cells = {
        str(d): trials(movement_time_s=(2 + 3 * d,) * 2, waits=(3, 3)) for d in (1.0, 2.0, 3.0)
    }
    assert of.wait_values(cells) == pytest.approx({"S13/linear": 1.0, "S13/slope": 0.0})


def test_times_that_no_delay_changes_lie_on_no_line():
    cells = {str(d): trials(movement_time_s=(2, 2), waits=(1, 1)) for d in (1.0, 2.0, 3.0)}
    found = of.wait_values(cells)
    assert math.isnan(found["S13/linear"])
    assert found["S13/slope"] == pytest.approx(-1.0)


def test_who_waits_less_than_every_other_trial_has_no_slope_that_agrees():
    for waits, is_none in ((0, True), (1, False)):
        times = {d: (2 + 0.5 * d,) * 2 for d in (1.0, 2.0, 3.0)}
        cells = {str(d): trials(movement_time_s=t, waits=(0, waits)) for d, t in times.items()}
        assert math.isnan(of.wait_values(cells)["S13/slope"]) == is_none


def test_frame_rates_that_act_as_half_a_frame_of_delay_collapse_at_a_half():
    cells = {
        of.frame_cell(rate, delay): timed(
            1 + 2 * (delay + 0.5 / rate), 1 + 2 * (delay + 0.5 / rate)
        )
        for rate in of.FRAME_RATES
        for delay in of.FRAME_DELAYS_S
    }
    assert of.frame_values(cells) == pytest.approx({"S15/c": 0.5, "S15/collapse": 1.0})
