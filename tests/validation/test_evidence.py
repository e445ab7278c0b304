"""The table of evidence: its words, its head, what is written, and other subjects beside it."""

import math
from dataclasses import replace
from xml.etree import ElementTree

import pytest
from helpers.wording import unnamed

from dva_sim.kernel.errors import ConfigError
from dva_sim.validation import figure
from dva_sim.validation.evidence import (
    RULE,
    Evidence,
    headline,
    passes,
    read_evidence,
    share_rule,
    short_number,
)
from dva_sim.validation.evidence_page import LONG, NAME, ValidationResult, make_sheets

AGE = Evidence(
    "network",
    "Without loss",
    "pub50 age_p50",
    "age when applied, median",
    source="real sockets",
    unit="ms",
    measured=105.3,
    predicted=106.0,
    low=98.0,
    high=112.6,
    sample=6,
    verdict="holds",
)
LATE = replace(AGE, line="pub50 age_p95", predicted=140.0, verdict="misses", note="a tie")
SHOWN = replace(AGE, line="pub50 queue", low=None, high=None, verdict="shown only", note="no band")
ALL = share_rule("network", "without loss", 1, 2)
WALK = Evidence("operators", "Exact", "S16d/mean", "mean", measured=1.34, predicted=1.338)


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (0.19, 0.59, "0.19 to 0.59"),
        (None, 3.0, "at most 3"),
        (120.0, None, "at least 120"),
        (0.0, 0.0, "0"),
        (None, None, "–"),
    ],
)
def test_a_band_may_have_two_ends_one_or_none(low, high, words):
    assert replace(AGE, low=low, high=high).words[4] == words


def test_a_line_in_words_has_its_unit_and_the_interval_of_the_prediction():
    line = replace(LATE, predicted_low=131.04, predicted_high=150.0)
    assert line.words == (
        *("pub50 age_p95", "age when applied, median [ms]", "105.3", "140 (131 to 150)"),
        *("98 to 112.6", "misses: a tie"),
    )


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (float("nan"), "–"),
        (math.inf, "∞"),
        (12345.6, "12346"),
        (0.12345, "0.1235"),
    ],
)
def test_numbers_have_four_digits_that_count(value, text):
    assert short_number(value) == text


def test_the_head_counts_judged_lines_and_names_all_that_miss_condition_by_condition():
    again = replace(LATE, line="pub50 rtt_p50")
    text = headline([AGE, LATE, again, SHOWN, ALL])
    assert text.startswith("1 of 3 ")
    assert not unnamed(text, ": pub50 age_p95, rtt_p50.", "without loss (0.5, 1 of 2;", " 1)")


def test_of_many_conditions_that_miss_the_head_gives_the_number():
    many = [replace(LATE, line=f"pub{n} age_p95") for n in range(30)]
    text = headline([AGE, *many])
    assert text.startswith("1 of 31 ")
    assert not unnamed(text, "30 conditions")


def test_lines_that_are_too_rough_are_counted_apart():
    text = headline([AGE, replace(AGE, verdict="too rough")])
    assert not unnamed(text, "1 of 2 ", " 1 are too rough")


def test_a_subject_passes_if_it_has_a_rule_and_all_of_it_holds():
    held = replace(ALL, verdict="holds")
    assert passes([LATE, held])
    assert passes([LATE, held, replace(ALL, verdict="shown only")])
    assert not passes([AGE, held, ALL])
    assert not passes([AGE])


def test_a_share_that_is_reached_but_for_rounding_holds():
    assert share_rule("operators", "held-out", 8, 10, least=0.8).verdict == "holds"
    assert share_rule("operators", "held-out", 7, 10, least=0.8).verdict == "misses"


def test_of_a_long_group_a_terminal_shows_what_does_not_hold_and_the_number_that_does():
    many = [replace(AGE, line=f"pub{n} age_p50") for n in range(LONG)]
    [whole, _] = make_sheets(many, LONG)
    assert len(whole.rows) == 1 + LONG  # their source, and all
    [cut, _] = make_sheets([*many, LATE], LONG)
    assert cut.rows == [("real sockets",), LATE.words]
    assert cut.text == f"{LONG} of {LONG + 1} lines hold."


@pytest.fixture
def written(tmp_path):
    conditions = {"seed": "1", "length": "quick"}
    ValidationResult([AGE, LATE, SHOWN, ALL], conditions=conditions).write(tmp_path)
    return tmp_path


@pytest.mark.system  # it draws
def test_a_written_table_is_read_as_it_was_with_the_conditions_at_its_rule(written):
    rule = replace(ALL, source="seed: 1; length: quick")
    assert read_evidence(written / "evidence.csv") == [AGE, LATE, SHOWN, rule]


@pytest.mark.system  # it draws
def test_another_subject_joins_the_table_and_the_same_one_replaces_its_lines(written):
    ValidationResult([WALK]).write(written)
    ValidationResult([LATE, ALL]).write(written)
    lines = read_evidence(written / "evidence.csv")
    assert [line.line for line in lines] == ["S16d/mean", "pub50 age_p95", "without loss"]
    page = (written / "index.html").read_text()
    assert not unnamed(page, "Operators beside people", "0 of 1 lines hold", "misses: a tie")


def test_a_folder_with_another_table_of_that_name_is_refused(tmp_path):
    (tmp_path / f"{NAME}.csv").write_text("a,b\n1,2\n")
    with pytest.raises(ConfigError, match="table of evidence"):
        ValidationResult([AGE, ALL]).write(tmp_path)


@pytest.mark.system  # it draws
def test_the_figure_has_a_panel_for_each_judged_subject_and_places_bands_as_ratios():
    judged = replace(WALK, verdict="holds")
    drawn = figure.draw([AGE, LATE, SHOWN, judged])
    titles = [axes.get_title(loc="left") for axes in drawn.figure.axes]
    assert not unnamed(titles[0], "Operators", "1 of 1")
    assert not unnamed(titles[1], "Network", "1 of 2")
    assert ElementTree.fromstring(drawn.svg).tag.endswith("svg")


@pytest.mark.parametrize(
    ("line", "ratios"),
    [
        (AGE, (105.3, 106 / 105.3, 98 / 105.3, 112.6 / 105.3)),
        (replace(AGE, holds_measured=True), (105.3, 106 / 105.3, 106 / 112.6, 106 / 98)),
        (replace(AGE, measured=None), (105.3, 106 / 105.3, 98 / 105.3, 112.6 / 105.3)),
        (replace(AGE, high=None), (105.3, 106 / 105.3, 106 / 105.3, 106 / 105.3)),
    ],
)
def test_a_band_around_the_prediction_stands_as_far_off_as_one_around_what_was_measured(
    line, ratios
):
    assert figure.ratios(line) == pytest.approx(ratios)


@pytest.mark.parametrize("changes", [{"measured": 0.0}, {"predicted": math.inf}])
def test_a_line_without_a_ratio_is_in_the_table_alone(changes):
    assert figure.ratios(replace(AGE, **changes)) is None


def test_a_rule_is_no_claim():
    assert ALL.group == RULE
    assert headline([AGE, ALL]).startswith("1 of 1")
