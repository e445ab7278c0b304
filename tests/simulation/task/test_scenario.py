import pytest
from helpers.wording import unnamed

from dva_sim.kernel import resources
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.task import build, rehearse

SHIPPED = sorted(resources.available("experiments/scenarios/tasks"))
TILTED = "task: {{kind: pointing}}\ndevice: {{kind: tilt_velocity, {}}}"
TUNNEL = "task: {kind: tunnel, shape: circular, length_m: 0.1, width_m: 0.05}"


def point(**keys):
    return {"model": "task", "task": {"kind": "pointing"}, **keys}


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_task_can_be_begun_and_says_where_it_is_from(name):
    document = load_yaml(resources.find(name, "experiments/scenarios/tasks"))
    scenario = build(document)
    rehearse(scenario)
    assert "assumed" in scenario.description.lower()


def test_several_amplitudes_and_widths_are_crossed():
    task = {"kind": "pointing", "amplitude_m": [0.1, 0.2], "width_m": [0.01, 0.02]}
    conditions = [(0.1, 0.01), (0.1, 0.02), (0.2, 0.01), (0.2, 0.02)]
    assert list(build(point(task=task)).task.conditions()) == conditions
    # A study can put one value in the place of several.
    one = build(point(task=task), {"task.width_m": 0.03})
    assert list(one.task.conditions()) == [(0.1, 0.03), (0.2, 0.03)]


@pytest.mark.parametrize(
    ("text", "place", "names"),
    [
        ("task: {kind: pointing, wide_m: 1}", ":2:24", "'task.wide_m'"),
        ("task: {kind: juggling}", ":2:", "task"),
        ("task: {kind: pointing}\noperator: {strategy: pursit}", ":3:12", "operator 'pursit'"),
        ("task: {kind: pointing}\noperator: {traits: {nerve: 2}}", ":3:12", "traits 'nerve'"),
        ("task: {kind: pointing, width_m: -1}", ":2:24", "task.width_m"),
        (TILTED.format("filter: magic"), ":3:31", "filter 'magic'"),
        (TILTED.format("accelerometer: bma"), ":3:31", "accelerometer 'bma'"),
        ("task: {kind: pointing, cursor_m: 0.02}", ":2:1", "cursor_m 0.02 below"),
        (TUNNEL, ":2:1", "width_m 0.05 length_m 0.1"),
        ("task: {kind: slalom, swing_m: 0.5}", ":2:1", "cones stand in the way"),
        ("task: {kind: corner}", ":1:1", "corner device.kind joystick 'mouse'"),
        ("task: {kind: corner}\ndevice: {kind: joystick}", ":1:1", "corner plant.speed_mps"),
        ("task: {kind: tracking}", ":1:1", "horizon_s 30 130"),
        (
            "task: {kind: pointing}\nlink: {up: {delay_s: 0.1, jitter_s: 0.2}}",
            *(":3:8", "jitter_s 0.2 delay_s 0.1"),
        ),
    ],
)
def test_a_mistake_is_one_line_with_its_place(tmp_path, text, place, names):
    path = tmp_path / "mine.yaml"
    path.write_text(f"model: task\n{text}\n")
    with pytest.raises(ConfigError) as caught:
        build(load_yaml(path))
    assert unnamed(caught.value, place, *names.split()) == []
    assert "\n" not in str(caught.value)
