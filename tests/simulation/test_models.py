"""Measures that a study may request are exactly those in the rows of its model."""

import pytest
from helpers.studies.small_study import STUDY, study_in

from dva_sim.experiments.study import cell_grid
from dva_sim.kernel.errors import ConfigError
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


TUNED = (
    STUDY
    + """\
tuning:
  key: link.loss
  levels: [0.1, 0.2]
  by: [pattern]
  part: drive
  measure: drive_time_s
  seed: 9
"""
)


@pytest.mark.parametrize("asked", ["answer", "tuning"])
def test_a_measure_that_no_run_has_is_refused_at_its_place_before_any_run(tmp_path, asked):
    before, key, after = TUNED.partition(f"{asked}:\n")
    text = before + key + after.replace("measure: drive_time_s", "measure: time_s", 1)
    with pytest.raises(ConfigError) as refused:
        cell_grid.cells(study_in(tmp_path, text=text))
    assert refused.value.problem.startswith("measure 'time_s' ")
    assert refused.value.file.endswith("study.yaml")
    assert text.splitlines()[refused.value.line - 1] == "  measure: time_s"
