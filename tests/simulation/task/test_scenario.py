import pytest

from dva_sim.kernel import resources
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
    task = {"kind": "pointing", "amplitude_m": [0.1, 0.2], "width_m": [0.01, 0.02]}
    conditions = [(0.1, 0.01), (0.1, 0.02), (0.2, 0.01), (0.2, 0.02)]
    assert list(build(point(task=task)).task.conditions()) == conditions
    # A study can put one value in the place of several.
    one = build(point(task=task), {"task.width_m": 0.03})
    assert list(one.task.conditions()) == [(0.1, 0.03), (0.2, 0.03)]
