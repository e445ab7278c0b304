"""An operator's recorded actions send the same again, so the difference is its cost."""

import pytest
from helpers.network.replaying_operator import replay, taped

from dva_sim.simulation import scenario as scenarios


@pytest.mark.parametrize("profile", ["default", "dissertation"])
def test_a_run_with_its_commands_repeated_is_the_same_run(profile):
    changes = {"pattern": "latest-wins", "phone.profile": profile}
    scenario = scenarios.build(scenarios.load("drive-to-event"), changes)
    tape, full = taped(scenario, 1)
    bare = replay(scenario, 1, tape)
    assert bare.duration == full.duration > 30.0
    assert bare.recorder.counters == full.recorder.counters
    assert bare.recorder.tracks == full.recorder.tracks
