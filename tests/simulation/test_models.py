"""Measures that a study may request are exactly those in the rows of its model."""

import pytest

from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.models import model_of

SHORT = {
    "drive-to-event": {"horizon_s": 20, "disturbance.kind": "refuse", "disturbance.after_s": 2},
    "evacuation": {"horizon_s": 5},
    "asked-first": {"horizon_s": 5},
    "small-shift": {"horizon_s": 3000, "dispatch.containment": True},
    "tasks/fitts-lag": {"trials": 1},
    "tasks/fitts-tilt": {"trials": 1},
    "tasks/steering-law": {"trials": 1},
    "tasks/heading-step": {"trials": 1, "practice": 0},
    "tasks/tracking": {
        "task.record_s": 30,
        "task.frequencies_rad_s": [0.5, 1, 2, 4],
        "task.amplitudes_m": [0.01, 0.01, 0.01, 0.01],
    },
    "tasks/excavator": {"trials": 1, "practice": 0},
    "tasks/course": {"practice": 0, "horizon_s": 20},
}


def numbers_of(name):
    """The measures declared for a scenario's model, and the numbers that its rows really hold."""
    document = scenarios.load(name)
    model = model_of(document)
    (row,) = model.tables(model.build(document, SHORT[name]), 1, with_tracks=False)["runs"]
    return model.measures(), {key for key, value in row.items() if not isinstance(value, str)}


@pytest.mark.system
@pytest.mark.parametrize(
    "names",
    [
        ("drive-to-event", "evacuation", "asked-first"),
        ("small-shift",),
        (
            "tasks/fitts-lag",
            "tasks/steering-law",
            "tasks/tracking",
            "tasks/heading-step",
            "tasks/course",
            "tasks/excavator",
            "tasks/fitts-tilt",
        ),
    ],
)
def test_the_measures_of_a_model_are_the_numbers_in_its_rows(names):
    declared = numbers_of(names[0])[0]
    assert len(set(declared)) == len(declared)
    assert set(declared) == set().union(*(numbers_of(name)[1] for name in names))
