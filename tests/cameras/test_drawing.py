"""The cameras of a run, from the scenario as another process receives it."""

import json

from dva_sim.cameras.drawing import Eyes
from dva_sim.cameras.lines import scene_line
from dva_sim.simulation.scenario import build, load


def test_a_run_whose_players_are_named_by_number_is_drawn():
    scenario = build(load("hands-on"), {"guard.kind": {2: "person"}, "camera.rate_hz": 4})
    line = json.loads(json.dumps(scene_line(scenario.model_dump(mode="json"), seed=1)))

    assert Eyes(line["scenario"], line["seed"]).rate == 4
