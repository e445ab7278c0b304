import pytest

from dva_sim.kernel import resources
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.task import build, rehearse

SHIPPED = sorted(resources.available("experiments/scenarios/tasks"))


def point(**keys):
    return {"model": "task", "task": {"kind": "pointing"}, **keys}


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_task_can_be_begun_and_says_where_it_is_from(name):
    document = load_yaml(resources.find(name, "experiments/scenarios/tasks"))
    scenario = build(document)
    rehearse(scenario)
    assert "assumed" in scenario.description.lower()


def test_several_amplitudes_and_widths_are_crossed():
    scenario = build(
        point(task={"kind": "pointing", "amplitude_m": [0.1, 0.2], "width_m": [0.01, 0.02]})
    )
    assert list(scenario.task.conditions()) == [(0.1, 0.01), (0.1, 0.02), (0.2, 0.01), (0.2, 0.02)]


def test_a_study_can_put_one_value_in_the_place_of_several():
    scenario = build(
        point(task={"kind": "pointing", "width_m": [0.01, 0.02]}), {"task.width_m": 0.03}
    )
    assert [width for _, width in scenario.task.conditions()] == [0.03]


@pytest.mark.parametrize(
    ("text", "place", "problem"),
    [
        ("task: {kind: pointing, wide_m: 1}", ":2:24", "unknown key 'task.wide_m'"),
        ("task: {kind: juggling}", ":2:", "task"),
        (
            "task: {kind: pointing}\noperator: {strategy: pursit}",
            ":3:12",
            "operator 'pursit' is unknown",
        ),
        (
            "task: {kind: pointing}\noperator: {traits: {nerve: 2}}",
            ":3:12",
            "operator.traits 'nerve' is unknown",
        ),
        ("task: {kind: pointing, width_m: -1}", ":2:24", "task.width_m"),
        (
            "task: {kind: pointing}\ndevice: {kind: tilt_velocity, filter: magic}",
            ":3:31",
            "filter 'magic' is unknown",
        ),
        (
            "task: {kind: pointing}\ndevice: {kind: tilt_velocity, accelerometer: bma}",
            ":3:31",
            "'bma' not found",
        ),
        ("task: {kind: pointing, cursor_m: 0.02}", ":2:1", "cursor_m 0.02 should be below"),
        (
            "task: {kind: tunnel, shape: circular, length_m: 0.1, width_m: 0.05}",
            ":2:1",
            "width_m 0.05 leaves no middle of a circle of length_m 0.1",
        ),
        ("task: {kind: slalom, swing_m: 0.5}", ":2:1", "the cones would stand in the way"),
        ("task: {kind: corner}", ":1:1", "a corner needs device.kind joystick, not 'mouse'"),
        (
            "task: {kind: corner}\ndevice: {kind: joystick}",
            ":1:1",
            "what is driven in a corner needs plant.speed_mps",
        ),
        (
            "task: {kind: tracking}",
            ":1:1",
            "horizon_s 30 should be above the 130 s that the task alone takes",
        ),
        (
            "task: {kind: pointing}\nlink: {up: {delay_s: 0.1, jitter_s: 0.2}}",
            ":3:8",
            "jitter_s 0.2 is above delay_s 0.1",
        ),
    ],
)
def test_a_mistake_is_one_line_with_its_place(tmp_path, text, place, problem):
    path = tmp_path / "mine.yaml"
    path.write_text(f"model: task\n{text}\n")
    with pytest.raises(ConfigError) as caught:
        build(load_yaml(path))
    assert place in str(caught.value)
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)
