"""Assumed times of shifts, which stand beside an answer."""

import pytest

from dva_sim.experiments.report.answer_conditions import assumed_times
from dva_sim.simulation.timed import build

FOUND = "found after exactly 3,600 s, by assumption"
GUARD = {
    "name": "post",
    "kind": "guard",
    "mobilisation": {"law": "constant", "mean_s": 12},
    "act": {"law": "constant", "mean_s": 90},
}
LOOK = {"law": "lognormal", "median_s": 7, "spread": 0.3}
ROBOT = {"name": "cart", "kind": "robot", "look": LOOK}


def scenario(*, notice="detectors", kind="gas_leak", team=GUARD, zones=None, **dispatch):
    stream = {"kind": kind, "between": {"law": "exponential", "mean_s": 600}, "notice": notice}
    own = {"model": "timed", "site": {"name": "caparica", "spots": 3}, "horizon_s": 7200}
    own["operators"] = {"count": 1}
    whole = own | {"demand": [stream | ({"zones": zones} if zones else {})], "dispatch": dispatch}
    return build(whole | {"responders": [team | {"speed_mps": 1.0}]}).model_dump(mode="json")


@pytest.mark.parametrize(
    ("settings", "said", "unsaid"),
    [
        ({}, [FOUND, "gas leak at 19 of 45 places"], ["fire"]),
        ({"kind": "fire"}, [FOUND], ["places"]),
        ({"notice": {"law": "constant", "mean_s": 5}}, ["12 s to set out"], [FOUND, "detector"]),
        ({"team": ROBOT}, ["cart typically 7 s to look"], ["to contain"]),
        ({"containment": True}, ["post typically 12 s to set out", "to contain"], []),
        ({}, ["to set out"], ["to contain"]),
    ],
)
def test_assumed_times_are_said_where_they_decide_and_only_there(settings, said, unsaid):
    text = assumed_times(scenario(**settings), {})
    assert [words for words in said if words not in text] == []
    assert [words for words in unsaid if words in text] == []


def test_places_are_not_counted_on_a_site_that_is_no_longer_there():
    gone = scenario() | {"site": {"name": "no-such-site.yaml", "spots": 3}}
    text = assumed_times(gone, {"no-such-site.yaml": "0"})
    assert FOUND in text
    assert "places" not in text
