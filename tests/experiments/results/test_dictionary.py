"""Every column of every table is explained, and its name ends in its unit."""

import re

import pytest
from helpers.studies.small_study import study_in

from dva_sim.experiments.results.results import describe
from dva_sim.experiments.results.tables import design_row
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.parts import DESIGN
from dva_sim.kernel.units import UNITS, ending_of, unit_of
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.models import MODELS, measured_names, model_of

SHORT = {
    "full": [("evacuation", {"horizon_s": 20, "bystander.count": 1})],
    "timed": [("patrol-shift", {"warm_up_s": 0, "horizon_s": 1200})],
    "task": [
        ("tasks/fitts-tilt", {"trials": 1, "practice": 0, "task.amplitude_m": [0.1]}),
        ("tasks/fitts-lag", {"trials": 1, "practice": 0}),
        ("tasks/corner", {"trials": 1, "practice": 0, "task.width_m": [1.2]}),
        ("tasks/slalom", {"trials": 1, "practice": 0, "task.width_m": [2.0]}),
        ("tasks/tracking", {"trials": 1, "practice": 0, "task.record_s": 40}),
        ("tasks/excavator", {"trials": 1, "practice": 0, "horizon_s": 40}),
    ],
    "transports": [("congested-link", {"measure_s": 5, "warm_up_s": 2})],
}


# Filled where people drive alone: console/world/test_kept_results.py holds their columns to these.
OF_PEOPLE = {"full": {"drives", "commands", "reported"}}


def columns_of(model):
    """Columns that short runs of a model fill, by table."""
    found = {}
    for name, changes in SHORT[model]:
        document = scenarios.load(name)
        scenario = model_of(document).build(document, changes)
        for table, rows in MODELS[model].tables(scenario, 1, with_tracks=True).items():
            found.setdefault(table, set()).update(*rows)
    return found


@pytest.mark.system
@pytest.mark.parametrize("model", [name for name in MODELS if not MODELS[name].is_real_time])
def test_every_column_that_a_run_fills_is_in_the_dictionary(model):
    filled = columns_of(model)
    assert set(filled) == set(MODELS[model].columns) - OF_PEOPLE.get(model, set())
    for table, columns in filled.items():
        reported = describe(table, sorted(columns), [model], [])
        assert [column.name for column in reported if not column.meaning] == []


@pytest.mark.parametrize("model", MODELS)
def test_no_table_has_two_columns_of_one_name(model):
    for columns in MODELS[model].columns.values():
        names = [column.name for column in columns]
        assert sorted(set(names)) == sorted(names)


def test_the_columns_of_the_design_are_explained(tmp_path):
    study = study_in(tmp_path)
    last = design_row(cell_grid.jobs(study)[-1])
    assert set(last) - set(study.factors) <= set(DESIGN)


def test_no_column_shares_its_name_with_the_design():
    assert not measured_names() & set(DESIGN)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("drive_time_s", "s"),
        ("contact_impulse_n_s", "N s"),
        ("crossover_rad_s", "rad/s"),
        ("exposure_max_s_per_h", "s/h"),
        ("turns_per_min", "per min"),
        ("traffic_bytes", "B"),
        ("id_slope_s_per_bit", "s/bit"),
        ("link.up.delay_s", "s"),
        ("jams", ""),
        ("person.s", ""),
    ],
)
def test_the_unit_is_the_end_of_the_name(name, unit):
    assert unit_of(name) == unit


def test_every_unit_can_be_found_by_its_ending():
    assert [ending_of(f"delay_{ending}") for ending in UNITS] == list(UNITS)


def test_a_factor_and_a_column_with_two_meanings_are_told_as_such():
    values = {c.name: c.meaning for c in describe(
        "runs", ["pattern", "messages", "mine_s"], ["full", "timed"], ["pattern"]
    )}  # fmt: skip
    assert values["pattern"].startswith("factor of the study")
    assert re.match(r"full: .*; timed: ", values["messages"])
    assert values["mine_s"] == ""
