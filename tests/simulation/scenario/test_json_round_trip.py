"""A scenario goes to other processes and into recordings as JSON, and comes back the same."""

import json

import pytest

from dva_sim.simulation.scenario import Scenario, build, load


@pytest.mark.parametrize(
    "changes",
    [
        {"guard.kind": "person"},
        {"guard.kind": {2: "person"}},
        {"operator.kind": {1: "person"}},
        {"dva.severity": "followed"},
    ],
)
def test_it_comes_back_from_json_the_same(changes):
    scenario = build(load("hands-on"), changes)
    document = json.loads(json.dumps(scenario.model_dump(mode="json")))
    assert Scenario.model_validate(document) == scenario
