from collections import defaultdict

import pytest
from helpers.wording import unnamed

from dva_sim.kernel.config import titled_keys
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import listing, number, percent
from dva_sim.simulation.labels import (
    brief,
    factor_name,
    level_name,
    measure_called,
    measure_name,
    setting,
    stated_conditions,
)
from dva_sim.simulation.models import MODELS


@pytest.mark.parametrize(
    ("factor", "level", "text"),
    [
        ("link.delay_s", 0, "0"),
        ("link.delay_s", 0.05, "50 ms"),
        ("link.delay_s", 1.0, "1 s"),
        ("command.rate_hz", 10, "10 Hz"),
        ("pattern", "req-rep", "REQ/REP"),
        ("operator.strategy", "pursuit", "pursuit"),
        ("phone.ideal", True, "yes"),
        ("phone.filter", "/some/where/mine.py:MyFilter", "MyFilter"),
    ],
)
def test_a_level_is_named_with_its_unit(factor, level, text):
    assert level_name(factor, level).replace("\N{NO-BREAK SPACE}", " ") == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (0.123, "0.12"), (1.26, "1.3"), (14.24, "14.2"), (300.4, "300"), (-0.001, "0")],
)
def test_a_number_keeps_no_more_figures_than_it_deserves(value, text):
    assert number(value) == text


def test_a_missing_number_is_a_dash_and_a_negative_one_has_a_minus_sign():
    assert number(float("nan")) == "–"
    assert number(-2.5) == "\N{MINUS SIGN}2.5"


@pytest.mark.parametrize(
    ("share", "text"),
    [(0, "0 %"), (0.117, "12 %"), (0.004, "0.4 %"), (0.996, "99.6 %"), (1, "100 %")],
)
def test_a_small_share_is_never_rounded_to_none_or_all(share, text):
    assert percent(share).replace("\N{NO-BREAK SPACE}", " ") == text


def test_a_name_that_is_only_a_unit_has_no_unit():
    assert unit_of("s") == ""
    assert unit_of("drive_time_s") == "s"


def test_words_are_listed_as_people_do():
    assert listing([]) == ""
    assert listing(["a"]) == "a"
    assert listing(["a", "b", "c"]) == "a, b and c"
    reported = setting({"profile": "default", "link.loss": 0.1})
    assert unnamed(reported, "profile default", "loss 10\N{NO-BREAK SPACE}%") == []


@pytest.mark.parametrize(
    ("levels", "text"),
    [
        ({"link.delay_s": 0.25, "pattern": "latest-wins"}, "250 ms, latest-wins"),
        ({"link.delay_s": 0}, "0 ms"),
        ({"link.delay_s": 0.25, "link.jitter_s": 0.02}, "one-way delay 250 ms, jitter 20 ms"),
        ({"bystander.count": 3, "phone.ideal": True}, "bystanders 3, phone ideal yes"),
    ],
)
def test_briefly_told_levels_leave_out_what_goes_without_saying(levels, text):
    assert brief(levels).replace("\N{NO-BREAK SPACE}", " ") == text


def test_a_law_that_a_treatment_sets_is_told_key_by_key():
    law = {"law": "gamma", "mean_s": 0.05, "cv": 0.5}
    reported = level_name("robot.processing_s", law)
    assert reported.split(", ") == ["law gamma", "mean_s 50\N{NO-BREAK SPACE}ms", "cv 0.5"]


def test_a_list_that_a_treatment_sets_is_told_one_by_one():
    outages = [{"from_s": 7, "for_s": 2}, {"from_s": 20, "for_s": 1}]
    text = level_name("link.outages", outages).replace("\N{NO-BREAK SPACE}", " ")
    assert text.split("; ") == ["from_s 7 s, for_s 2 s", "from_s 20 s, for_s 1 s"]
    assert level_name("link.outages", []) == "none"


def test_a_key_has_one_name_in_all_models():
    titles = defaultdict(set)
    for model in MODELS.values():
        for path, key in titled_keys(model.scenario).items():
            titles[path].add(key.title)
    assert {path: found for path, found in titles.items() if len(found) > 1} == {}


def test_a_key_is_called_as_its_field_says():
    assert factor_name("link.up.delay_s") == "delay of commands"
    assert stated_conditions(["full"])["link.jitter_s"] == "jitter (half-width)"
    assert "link.up" not in stated_conditions(["task"])


def test_a_measure_is_called_as_its_column_says():
    assert measure_name("drive_time_s") == "driving time to confirmation"
    assert measure_name("jams") == "jams"
    assert measure_name("of_nobody_s") == "of nobody"
    assert measure_called("drive_time_s").awaits == "confirmation"
    assert measure_called("confirmed").bounds == (0, 1)
    assert measure_called("stop_share").bounds == (0, 1)
    assert measure_called("response_mean_s", "timed").high == 600


def test_what_is_better_is_said_where_it_is_not_small():
    better = {m.name for m in MODELS["full"].columns["runs"] if m.better == "large"}
    assert better == {
        *("confirmed", "evacuated_share", "commands_applied"),
        *("command_rate_hz", "settled_per_min", "alerted"),
    }
