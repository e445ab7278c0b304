import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.studies.synthetic_results import finding
from helpers.wording import unnamed

from dva_sim.experiments.analysis.answer import Missed, OtherRuns
from dva_sim.experiments.report.answer_sentences import answer


def lead(found):
    return answer(found).lead.replace("\N{NO-BREAK SPACE}", " ")


def measured(found):
    return answer(found).depends["Measured"].replace("\N{NO-BREAK SPACE}", " ")


GROWING = [0.1, 0.2, 0.3, 3.0, 6.0, 14.2]


USUAL = np.full(6, 35.0)
WIDE = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 80.0])
IN_WORDS = {
    "a growing effect: contrast, conditions, interval, reach, and what is ruled out below it": (
        finding(GROWING),
        [
            *("longer with REQ/REP than", "+14.2 s", "delay 1 s, with profile default"),
            *("95 % band 13.2 to 15.2 s", "from 250 ms on", "to 100 ms", "above 1.3 s"),
        ],
    ),
    "without any effect: what is ruled out, and what matters": (
        finding([0.0] * 6),
        [
            "No difference",
            "any level of one-way delay",
            "above 1.0 s are excluded",
            "2 s that matter",
        ],
    ),
    "levels where every pair is equal, apart from those that are settled": (
        finding([0, 0.2, 0, 3.0, 6.0, 9.0], half_width=np.array([0.0, 1.0, 1.0, 1.0, 1.0, 1.0])),
        [
            "delay 0, every pair of runs gives the same value",
            " 50 ms",
            " 100 ms",
            "above 1.2 s",
        ],
    ),
    "a band too wide to rule out what matters: more persons": (
        finding([0] * 6, half_width=5, persons=4),
        ["too small to tell", "4 persons", "every level of one-way delay", "up to 5.0 s"],
    ),
    "few persons who rule out less than what is usual, where nothing was declared to matter": (
        finding([9] * 6, half_width=80, persons=4, smallest_effect=None, usual=USUAL),
        ["too small to tell", "4 persons", "profile default (95 %", "up to 89.0 s"],
    ),
    "few shifts": (
        finding([0, 0], 5, persons=6, cluster="shift", levels=(0.5, 0.9), over="load"),
        ["too small to tell", "6 shifts"],
    ),
    "enough persons for what is usual, where nothing was declared to matter": (
        finding([9] * 6, half_width=20, smallest_effect=None, usual=USUAL),
        ["No difference", "above 29.0 s are excluded"],
    ),
    "one wide level beside what the others rule out": (
        finding([0, 0, 0, 0, 6.0, 20.0], half_width=WIDE),
        ["longer", "+6.0 s", "to 250 ms", "above 1.0 s", "delay 1 s", "undecided", "up to 100 s"],
    ),
    "the opposite direction": (
        finding([0, 0, 0, 0, 0, -4.0]),
        ["shorter", "−4.0 s", "delay 1 s", "95 % band −5.0 to −3.0 s", "only there"],
    ),
    "both directions of an effect that turns round": (
        finding([-3.0, -3.0, 0, 0, 5.0, 9.0]),
        ["longer", "+9.0 s", "from 500 ms on", "shorter up to 50 ms: −3.0 s"],
    ),
    "scattered levels one by one": (
        finding([0, 3.0, 0, 0, 3.0, 0]),
        [" 50 ms and 500 ms", " 0, 100 ms, 250 ms and 1 s"],
    ),
    "an effect below what matters": (
        finding([1.0] * 6, half_width=0.5),
        ["but less than the 2 s"],
    ),
    "a level without runs": (finding([0, 0, 0, 0, np.nan, 0]), ["500 ms, runs are missing"]),
    "another measure in its own unit": (
        finding(GROWING, measure="path_m", in_excess=False, smallest_effect=None),
        ["higher with REQ/REP", "+14.2 m"],
    ),
    "a delay of zero": (
        finding([9.0, 0.0], over="link.delay_s", levels=(0.0, 0.5)),
        ["delay 0", "95 %"],
    ),
    "a level that is a word": (
        finding([0.0, 9.0], over="link", levels=("good", "poor")),
        ["with link poor"],
    ),
    "counts, all of them": (
        finding([3.0, 5.0, 9.0], over="robot.count", levels=(1, 2, 8)),
        ["with robots 8", "every level of robots tried"],
    ),
    "counts that are words": (
        finding([0.0, 9.0], over="crowd", levels=("0", "1")),
        ["with TCP flows each way 1", "TCP flows each way 0,"],
    ),
    "a filter": (
        finding([0.0, 9.0], over="phone.filter", levels=("none", "one_pole")),
        ["with one-pole filter"],
    ),
}


@pytest.mark.parametrize(("found", "names"), IN_WORDS.values(), ids=IN_WORDS)
def test_the_answer_tells(found, names):
    assert unnamed(text := lead(found), *names) == []
    assert not ("No difference" in text and "too small to tell" in text)
    # What matters is not said to be small.
    assert ("but less" in text) == any("but less" in name for name in names)


@pytest.mark.parametrize(
    "mean", [GROWING, [0.0] * 6, [-3.0, -3.0, 0, 0, 5.0, 9.0], [0, 0, 0, 0, np.nan, 0]]
)
def test_the_answer_is_of_whole_sentences(mean):
    wide = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 5.0])
    text = lead(finding(mean, half_width=wide, within={}))
    first, *more = re.split(r"(?<=[.]) ", text)
    assert more
    assert [s for s in (first, *more) if not (s[0].isupper() and s.endswith("."))] == []


def test_the_number_up_to_which_more_help_is_named_for_a_count_alone():
    found = finding([3.0, 5.0, 9.0], over="robot.count", levels=(1, 2, 8))
    sides = (("supervisory", 2), ("direct", 1))
    text = lead(replace(found, useful=sides))
    assert re.search(r"help up to 2 .* 1 with ", text)
    assert "to help" not in lead(found)


OTHERS = {"low": 1.0, "high": 9.0, "means": (2.0, 8.0)}


@pytest.mark.parametrize(
    ("within", "count", "turns", "said"),
    [
        ({"setting": "near"}, 1, False, "the other level of setting it is +1.0 to +9.0 s"),
        ({"setting": "near"}, 3, False, "the 3 other levels of setting it is +1.0 to +9.0 s"),
        ({"setting": "near", "crowd": "0"}, 3, False, "3 other combinations of setting and TCP"),
        ({"setting": "near"}, 2, True, "depends on the setting: +1.0 to +15.2 s"),
        ({"setting": "near"}, 2, True, "over 3 levels of setting"),
        ({"phone.profile": "default"}, 2, True, "depends on the phone: +1.0"),
    ],
)
def test_the_other_levels_that_were_run_are_named_by_their_factor(within, count, turns, said):
    others = OtherRuns(**OTHERS, count=count, turns=turns)
    text = lead(finding(GROWING, within=within, elsewhere=others))
    assert said in text
    assert "other setting" not in text
    alone = lead(finding(GROWING, within=within))
    assert "other level" not in alone
    assert "other combination" not in alone


def test_one_person_gives_the_plain_mean_and_no_claim():
    nothing = np.full(6, np.nan)
    text = lead(finding(GROWING, low=nothing, high=nothing, persons=1))
    assert unnamed(text, "too small to tell", "profile default", "REQ/REP", "+14.2 s") == []
    assert "95 %" not in text


def test_persons_who_do_not_differ_give_no_interval():
    nothing = np.full(6, np.nan)
    text = lead(finding([0.0] * 6, low=nothing, high=nothing))
    assert text.startswith("The difference")
    assert " equals " in text


def test_without_any_complete_pair_the_question_stays_open():
    nothing = np.full(6, np.nan)
    text = lead(finding(nothing, low=nothing, high=nothing, persons=0))
    assert text.startswith("No pair")


def test_missed_confirmations_are_told_per_pattern_with_the_horizon():
    missed = (Missed("req-rep", 14, 120), Missed("latest-wins", 0, 120))
    text = measured(finding(GROWING, missed=missed, horizon=300.0, part="drive"))
    counts = ("REQ/REP 12 % (14 of 120)", "latest-wins PUB/SUB 0 % (0 of 120)")
    assert (
        unnamed(text, "part drive", "without confirmation", "delay 1 s", *counts, "(300 s)") == []
    )


def test_it_is_told_what_is_measured_and_in_which_part():
    text = measured(finding(GROWING, part="drive"))
    assert unnamed(text, "part drive", "driving time", "beyond") == []


@pytest.mark.parametrize("mean", [[3.0], [0.0]])
def test_a_study_of_one_factor_gets_a_sentence_without_a_range(mean):
    text = lead(finding(mean, over="", levels=(None,), within={}, smallest_effect=None))
    assert "(95 % interval" in text
    assert "  " not in text
    assert "one-way delay" not in text


def test_a_band_as_wide_as_all_that_is_possible_is_told_to_rule_out_nothing():
    text = lead(finding([0] * 6, half_width=240, widest=240.0, persons=2))
    assert unnamed(text, "every level", "2 persons", "nothing") == []
    assert "240" not in text


@pytest.mark.parametrize("mean", [GROWING, [0.0] * 6])
def test_a_sentence_begins_with_a_capital_letter_also_without_conditions(mean):
    assert lead(finding(mean, within={}, first="on_change"))[0].isupper()


def test_that_every_event_was_confirmed_is_told_of_the_part_it_holds_for():
    missed = (Missed("req-rep", 0, 120), Missed("latest-wins", 0, 120))
    text = measured(finding(GROWING, missed=missed, part="drive"))
    assert unnamed(text, "part drive", "every run", "delay 1 s") == []
    text = measured(finding(GROWING, missed=missed, all_confirmed=True, part="drive", failed=1))
    assert unnamed(text, "every run", "fail") == []
