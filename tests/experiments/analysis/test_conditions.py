"""Conditions of a study: what is special about links, and where a request sent again is in time."""

import re
from typing import Any

from helpers.wording import unnamed

from dva_sim.experiments.analysis.conditions import conditions
from dva_sim.experiments.analysis.study_view import keys_of
from dva_sim.experiments.report.method import timeout_remark
from dva_sim.simulation import scenario as scenarios

SCENARIO = {
    "command": {"timeout_s": 9.0},
    "robot": {"processing_s": 0.05},
    "link": {"delay_s": 0.0, "up": None},
}


def text_of(factors: dict[str, list[Any]], treatments: dict[str, Any] | None = None) -> str:
    study = {"factors": factors, "treatments": treatments or {}}
    return timeout_remark({"drive": SCENARIO}, study).replace("\N{NO-BREAK SPACE}", " ")


def test_nine_seconds_are_enough_for_a_second_each_way():
    text = text_of({"link.delay_s": [0.0, 1.0]})
    assert unnamed(text, "above four round trips", "every condition (8.05 s") == []


def test_conditions_with_too_short_a_time_out_are_named():
    """Needed are 0.45, 0.85 and 1.65 s."""
    text = text_of({"command.timeout_s": [0.6, 1.2, 2.4], "link.delay_s": [0.05, 0.1, 0.2]})
    assert re.findall(r"[\d.]+ m?s", text) == ["600 ms", "200 ms", "400 ms", "1.2 s", "400 ms"]
    assert "In all others" in text


def test_where_all_are_too_short_there_are_no_others():
    text = text_of({"command.timeout_s": [0.3], "link.delay_s": [0.1]})
    assert unnamed(text, "300 ms", "200 ms", "others") == ["others"]


def test_what_a_treatment_changes_counts_only_together():
    """0.6 s stands with 10 ms each way alone, so that it is enough."""
    near = {"command.timeout_s": 0.6, "link.delay_s": 0.01}
    text = text_of(
        {"place": ["near", "far"]}, {"place": {"near": near, "far": {"link.delay_s": 1.0}}}
    )
    assert "is above" in text


def test_each_direction_counts_with_its_own_delay():
    """0.3 s up and 0.1 s down: 1.65 s, and not 0.85 s."""
    factors: dict[str, list[Any]] = {"command.timeout_s": [1.0], "link.delay_s": [0.1]}
    assert "trips of 400 ms" in text_of(factors | {"link.up.delay_s": [0.3]})
    assert "is above" in text_of(factors)


def test_the_mean_of_a_law_of_processing_counts():
    law = {"law": "lognormal", "mean_s": 1.0}
    factors: dict[str, list[Any]] = {"place": ["slow"]}
    assert "trips of 0" in text_of(
        factors, {"place": {"slow": {"robot.processing_s": law, "command.timeout_s": 0.9}}}
    )


def test_where_nobody_asks_nothing_is_said():
    assert timeout_remark({"drive": {"link": {"delay_s": 0.1}}}, {}) == ""


def test_in_a_range_the_farthest_end_counts():
    """Four round trips of 600 ms, and 200 ms."""
    ranges = {"link.delay_s": {"low": 0.0, "high": 0.3}, "link.loss": {"low": 0.0, "high": 0.1}}
    ranges["robot.processing_s"] = {"low": 0.02, "high": 0.2}
    study = {"factors": {"point": list(range(8))}, "design": {"sobol": 8, "ranges": ranges}}
    reported = timeout_remark({"drive": SCENARIO}, study)
    assert reported.endswith("(2.6\N{NO-BREAK SPACE}s at most).")


def test_what_lies_in_a_range_is_said_to_vary():
    design = {"sobol": 8, "ranges": {"link.delay_s": {"low": 0.0, "high": 0.3}}}
    factors = keys_of({"factors": {"point": list(range(8))}, "design": design})
    assert ("one-way delay", ["varied"]) in conditions({"drive": SCENARIO}, factors)


def special(**link: Any) -> list[str]:
    """Remarks on a link beyond those on a plain one."""
    reports = []
    for changes in ({}, {f"link.{key}": value for key, value in link.items()}):
        scenario = scenarios.build(scenarios.load("drive-to-event"), changes)
        reports.append(dict(conditions({"drive": scenario.model_dump(mode="json")}, [])))
    plain, found = reports
    return sorted(value for name, (value,) in found.items() if name not in plain)


def test_what_is_special_about_a_link_is_told_and_no_more():
    assert special(delay_s=0.1, loss=0.01) == []
    ways = {"loss": 0.02, "reorder": True, "queue_packets": 50, "up": {"loss": 0.2}}
    found = special(bursts={"mean_s": 0.1}, outages=[{"from_s": 3, "for_s": 2}], **ways)
    outage = "from_s 3.0, for_s 2.0, direction both"
    assert found == ["50", outage, "loss 0.2", "mean_s 0.1, loss 1.0", "yes"]


def test_a_size_that_is_no_number_is_told_as_it_stands():
    rows = dict(conditions({"drive": {"camera": {"frame_bytes": "many"}}}, []))
    assert ["many"] in rows.values()
