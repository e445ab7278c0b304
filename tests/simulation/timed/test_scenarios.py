"""Changes of a timed scenario, and events that wait."""

from typing import Any

import pytest

from dva_sim.simulation.timed import build

GOOD: dict[str, Any] = {
    "model": "timed",
    "responders": [{"name": "guard"}],
    "demand": [{"between": 10}],
}


def test_changes_reach_into_lists_by_number():
    scenario = build(GOOD, {"responders.0.count": 3, "demand.0.between": 7, "horizon_s": 60})
    assert scenario.names == ["guard-1", "guard-2", "guard-3"]
    assert scenario.demand[0].between.mean == 7


@pytest.mark.parametrize("never", [None, float("inf")])
def test_an_event_may_wait_forever(never):
    scenario = build(GOOD | {"dispatch": {"escalate_after_s": never}})
    assert scenario.dispatch.escalate_after_s == never
