import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.wording import unnamed

from dva_sim.experiments.analysis.answer import Finding, Missed, answer

DELAYS = (0.0, 0.05, 0.1, 0.25, 0.5, 1.0)


def finding(mean, half_width=1.0, **changes):
    """A finding whose band is `half_width` [s] wide on either side."""
    mean = np.array(mean, dtype=float)
    whole = Finding(
        measure="drive_time_s",
        in_excess=True,
        factor="pattern",
        first="req-rep",
        second="latest-wins",
        over="link.delay_s",
        levels=DELAYS,
        within={"profile": "default"},
        mean=mean,
        low=mean - half_width,
        high=mean + half_width,
        persons=24,
        smallest_effect=2.0,
    )
    return replace(whole, **changes)


def lead(found):
    return answer(found).lead.replace("\N{NO-BREAK SPACE}", " ")


def measured(found):
    return answer(found).depends["Measured"].replace("\N{NO-BREAK SPACE}", " ")


GROWING = [0.1, 0.2, 0.3, 3.0, 6.0, 14.2]


def test_a_growing_effect_is_told_with_contrast_conditions_interval_and_reach():
    text = lead(finding(GROWING))
    parts = (
        "profile default, REQ/REP takes 14.2 s longer",
        "delay of 1 s",
        "95 % band 13.2 to 15.2 s",
    )
    assert unnamed(text, *parts, "from 250 ms on; ") == []


@pytest.mark.parametrize(
    "mean", [GROWING, [0.0] * 6, [-3.0, -3.0, 0, 0, 5.0, 9.0], [0, 0, 0, 0, np.nan, 0]]
)
def test_the_answer_is_two_sentences(mean):
    wide = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 5.0])
    text = lead(finding(mean, half_width=wide, within={}))
    assert re.findall(r"[.] (?=[A-Z])", text) == [". "]
    assert text.endswith(".")


def test_where_there_is_no_effect_the_size_that_is_ruled_out_is_told():
    assert unnamed(lead(finding(GROWING)), "up to 100 ms", "below 1.3 s", "2 s declared") == []


def test_without_any_effect_the_whole_range_is_ruled_out_and_compared_with_what_matters():
    text = lead(finding([0.0] * 6))
    assert unnamed(text, "no difference", "any one-way delay", "below 1.0 s", "2 s declared") == []


def test_levels_where_every_pair_is_equal_are_told_apart_from_those_that_are_settled():
    half_width = np.array([0.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    text = lead(finding([0, 0.2, 0, 3.0, 6.0, 9.0], half_width=half_width))
    assert unnamed(text, "; without delay both", "50 ms and 100 ms", "below 1.2 s") == []


def test_a_band_too_wide_to_rule_out_what_matters_says_that_more_persons_are_needed():
    text = lead(finding([0] * 6, half_width=5))
    assert unnamed(text, "every one-way delay", "up to 5.0 s", "more persons") == []


def test_one_wide_level_does_not_blur_what_the_others_rule_out():
    wide = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 80.0])
    text = lead(finding([0, 0, 0, 0, 6.0, 20.0], half_width=wide))
    ruled_out = ("takes 6.0 s longer", "up to 250 ms any effect is below 1.0 s")
    assert unnamed(text, *ruled_out, "at 1 s", "open", "up to 100 s") == []


def test_the_opposite_direction_is_told_as_it_is():
    text = lead(finding([0, 0, 0, 0, 0, -4.0]))
    parts = ("REQ/REP takes 4.0 s less", "delay of 1 s (95 % band 3.0 to 5.0 s)", "only there")
    assert unnamed(text, *parts) == []


def test_an_effect_that_turns_round_is_told_in_both_directions():
    text = lead(finding([-3.0, -3.0, 0, 0, 5.0, 9.0]))
    other_way = "up to 50 ms: REQ/REP takes 3.0 s less"
    assert unnamed(text, "takes 9.0 s longer", "from 500 ms on", other_way) == []


def test_scattered_levels_are_named_one_by_one():
    assert "50 ms and 500 ms" in lead(finding([0, 3.0, 0, 0, 3.0, 0]))


def test_an_effect_below_what_matters_is_not_sold_as_relevant():
    assert unnamed(lead(finding([1.0] * 6, half_width=0.5)), "but", "below", "2 s") == []


def test_one_person_gives_the_plain_mean_and_no_claim():
    nothing = np.full(6, np.nan)
    text = lead(finding(GROWING, low=nothing, high=nothing, persons=1))
    assert text.startswith("Too few persons")
    assert unnamed(text, "profile default", "REQ/REP", "14.2 s longer") == []
    assert "95 %" not in text


def test_persons_who_do_not_differ_give_no_interval():
    nothing = np.full(6, np.nan)
    text = lead(finding([0.0] * 6, low=nothing, high=nothing))
    assert text.startswith("The difference")
    assert "REQ/REP equals latest-wins PUB/SUB" in text


def test_without_any_complete_pair_the_question_stays_open():
    nothing = np.full(6, np.nan)
    text = lead(finding(nothing, low=nothing, high=nothing, persons=0))
    assert text.startswith("No pair")


def test_a_level_without_runs_is_named():
    assert "; at 500 ms" in lead(finding([0, 0, 0, 0, np.nan, 0]))


def test_missed_confirmations_are_told_per_pattern_with_the_horizon():
    missed = (Missed("req-rep", 14, 120), Missed("latest-wins", 0, 120))
    text = measured(finding(GROWING, missed=missed, horizon=300.0, part="drive"))
    counts = ("REQ/REP 12 % (14 of 120)", "latest-wins PUB/SUB 0 % (0 of 120)")
    assert unnamed(text, "part drive not confirmed", "delay of 1 s", *counts, "(300 s)") == []


def test_that_nothing_was_missed_is_told_too():
    missed = (Missed("req-rep", 0, 120), Missed("latest-wins", 0, 120))
    text = measured(finding(GROWING, missed=missed, part="drive"))
    assert unnamed(text, "In part drive", "every event", "delay of 1 s") == []


def test_it_is_told_what_is_measured_and_in_which_part():
    text = measured(finding(GROWING, part="drive"))
    assert unnamed(text, "In part drive", "driving time to confirmation", "beyond") == []


@pytest.mark.parametrize("mean", [[3.0], [0.0]])
def test_a_study_of_one_factor_gets_a_sentence_without_a_range(mean):
    text = lead(finding(mean, over="", levels=(None,), within={}, smallest_effect=None))
    assert "(95 % interval" in text
    assert "  " not in text
    assert "one-way delay" not in text


def test_another_measure_is_compared_in_its_own_unit():
    text = lead(finding(GROWING, measure="path_m", in_excess=False, smallest_effect=None))
    assert unnamed(text, "REQ/REP", "14.2 m above") == []


def test_a_band_as_wide_as_all_that_is_possible_is_told_to_rule_out_nothing():
    text = lead(finding([0] * 6, half_width=240, widest=240.0, persons=2))
    assert unnamed(text, "every one-way delay", "2 persons", "nothing") == []
    assert "240" not in text


@pytest.mark.parametrize("mean", [GROWING, [0.0] * 6])
def test_a_sentence_begins_with_a_capital_letter_also_without_conditions(mean):
    assert lead(finding(mean, within={}, first="on_change"))[0] in "ON"


def test_that_every_event_was_confirmed_is_told_of_the_part_it_holds_for():
    missed = (Missed("req-rep", 0, 120), Missed("latest-wins", 0, 120))
    text = measured(finding(GROWING, missed=missed, all_confirmed=True, part="drive", failed=1))
    assert unnamed(text, "every event", "did not fail") == []


@pytest.mark.parametrize(
    ("over", "levels", "words"),
    [
        ("link", ("good", "poor"), "PUB/SUB on the poor link"),
        ("phone.filter", ("none", "one_pole"), "PUB/SUB with one-pole filter"),
    ],
)
def test_levels_that_are_words_are_told_in_english(over, levels, words):
    found = finding([0.0, 9.0], over=over, levels=levels)
    assert words in lead(found)


def test_a_delay_of_zero_is_no_delay():
    text = lead(finding([9.0, 0.0], over="link.delay_s", levels=(0.0, 0.5)))
    assert unnamed(text, "without delay", "95 %") == []
