import pytest
from rich.console import Console

from dva_sim.cli.stories import tell
from dva_sim.experiments.report.episode import Played
from dva_sim.experiments.report.figures.trial import draw_trial, trial_figure
from dva_sim.kernel.resources import find
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.models import model_for
from dva_sim.simulation.task import build, trace_of

FOLDER = "experiments/scenarios/tasks"


def task(name, **changes):
    return build(load_yaml(find(name, FOLDER)), {"trials": 1, "practice": 0, **changes})


def played(name, **changes):
    scenario = task(name, **changes)
    return Played(scenario, 1, model_for(scenario).simulate(scenario, 1), 0.1)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("fitts-tilt", {"task.amplitude_m": 0.085}),
        ("steering-law", {"task.shape": "circular", "task.width_m": 0.01}),
        ("slalom", {"task.cones": 2, "task.spacing_m": 4.0}),
    ],
)
def test_a_trial_can_be_drawn(tmp_path, name, changes):
    path = tmp_path / "trial.png"
    draw_trial(task(name, **changes), seed=1, path=path)
    assert path.read_bytes().startswith(b"\x89PNG")


def test_a_block_is_told_with_its_conditions_and_what_they_come_to():
    out = Console(record=True, width=200)
    tell(played("fitts-lag", **{"task.amplitude_m": 0.05}), out)
    text = out.export_text()
    assert "amplitude" in text
    assert "100 %" in text
    assert "bit/s" in text


def test_a_table_on_80_columns_cuts_no_head_tells_units_and_says_how_many_rows_are_left_out():
    out = Console(record=True, width=80)
    tell(played("corner", trials=7, **{"task.leg_m": 3.0}), out)
    text = out.export_text()
    assert "…" not in text
    assert text.count("[m]") == 3  # length, width, off the middle
    assert text.count("[s]") == 2  # time, delay felt
    assert "1 more\n21 trials: " in text


@pytest.mark.parametrize(
    ("name", "changes", "unit", "title"),
    [
        ("fitts-tilt", {"trials": 15}, "mm", "amplitude 21.25 mm, width 6.8 mm, trial 1 of 135"),
        ("corner", {}, "m", "length 6 m, width 1.2 m, trial 1 of 6"),
    ],
)
def test_what_is_small_is_drawn_in_millimetres_and_the_title_says_which_trial_it_is(
    name, changes, unit, title
):
    scenario = task(name, **changes)
    row, trace = trace_of(scenario, 1)
    figure = trial_figure(scenario, row, trace)
    assert figure.axes[0].get_xlabel() == f"x [{unit}]"
    assert title in figure.get_suptitle()


def test_the_time_before_the_first_movement_is_marked_where_it_is_not_timed():
    tunnel, corner = task("steering-law"), task("corner")
    marks = [
        [patch.get_label() for patch in trial_figure(s, *trace_of(s, 1)).axes[1].patches]
        for s in (tunnel, corner)
    ]
    assert marks == [["not timed"], []]


def test_places_of_an_arm_are_numbered_and_the_body_of_a_vehicle_is_drawn_as_wide_as_it_is():
    arm, corner = task("excavator"), task("corner")
    places = trial_figure(arm, *trace_of(arm, 1)).axes[0].texts
    assert [text.get_text() for text in places] == ["1", "2", "3", "4", "5"]
    bodies = trial_figure(corner, *trace_of(corner, 1)).axes[0].patches
    assert len(bodies) > 3
    assert {2.0 * body.get_radius() for body in bodies} == {corner.plant.width_m}
