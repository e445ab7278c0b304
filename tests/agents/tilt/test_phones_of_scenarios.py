"""Stages of phones named by a scenario; wrong names are reported before anything runs."""

import pytest
from helpers.wording import unnamed

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import simulate
from dva_sim.simulation.measures import episodes

FILTER = """
from dva_sim.agents.tilt import Filter
class Mine(Filter):
    now = (0.0, 0.0)
    def add(self, sample):
        self.now = sample
    def value(self):
        return self.now
"""


@pytest.mark.parametrize(
    ("key", "names"),
    [
        ("phone.mapping_options.x", "mapping 'absolute' 'x' gain"),
        ("phone.filter_options.window", "filter 'median' 'window' 0;"),
        ("operator.options.x", "operator 'adaptive' 'x' closed"),
        ("dispatch.options.x", "policy 'min_eta' 'x'"),
    ],
)
def test_an_option_is_placed_where_it_stands_and_nowhere_if_it_came_as_a_change(
    key, names, tmp_path
):
    part, options, name = key.split(".")
    file = tmp_path / "scenario.yaml"
    file.write_text(f"horizon_s: 20\n{part}:\n  {options}:\n    {name}: 0\n")
    plain = tmp_path / "plain.yaml"
    plain.write_text(f"horizon_s: 20\n{part}: {{}}\n")
    with pytest.raises(ConfigError) as in_file:
        scenarios.build(load_yaml(file))
    with pytest.raises(ConfigError) as changed:
        scenarios.build(load_yaml(plain), {key: 0})
    assert str(in_file.value) == f"{file}:4:5: {changed.value}"
    assert unnamed(changed.value, *names.split()) == []


def test_a_filter_beside_its_scenario_drives_as_the_shipped_one_of_its_kind(tmp_path):
    (tmp_path / "mine.py").write_text(FILTER)
    text = "horizon_s: 20\nevents: [{kind: fire, room: North office, at_s: 2, reported: true}]\n"
    ways = []
    for name in ("mine.py:Mine", "none"):
        file = tmp_path / "scenario.yaml"
        file.write_text(text + f"phone: {{filter: '{name}'}}\n")
        recording = simulate(scenarios.build(load_yaml(file)), 3)
        ways.append([(a.time, a.sample_age) for d in recording.recorder.drives for a in d.applied])
    assert ways[0] == ways[1]
    assert len(ways[0]) > 50


@pytest.mark.parametrize("mapping", ["absolute", "differential", "leaky"])
def test_a_robot_arrives_with_every_mapping(mapping):
    built = scenarios.build(scenarios.load("drive-to-event"), {"phone.mapping": mapping})
    assert simulate(built, 1).recorder.drives[-1].outcome == "confirmed"


@pytest.mark.parametrize(
    ("stage", "fails", "works"),
    [("Filter", "value(self)", "add(self, s)"), ("Mapping", "command(*_)", "tilt_for(*_)")],
)
def test_a_stage_that_fails_is_told_at_once_and_counted_in_the_row_of_its_run(
    stage, fails, works, tmp_path
):
    file = tmp_path / "mine.py"
    file.write_text(
        f"from dva_sim.agents.tilt import {stage}\nclass Mine({stage}):\n"
        f"    def {fails}: return 1 / 0\n    def {works}: return 0.0, 0.0\n"
    )
    own = {f"phone.{stage.lower()}": f"{file}:Mine", "horizon_s": 60}
    run = simulate(scenarios.build(scenarios.load("drive-to-event"), own), 1)
    story = [moment for moment in run.recorder.timeline if "holds a phone" in moment.what]
    assert len(story) == sum(d.started is not None for d in run.recorder.drives)
    assert unnamed(story[0].what, "ZeroDivisionError: division by zero") == []
    begun = run.recorder.drives[0].started
    assert begun is not None
    assert begun <= story[0].time < begun + 3.0
    assert episodes.run_row(run)["plugin_failures"] > 100


def test_in_a_run_of_shipped_parts_no_plugin_fails():
    run = simulate(scenarios.build(scenarios.load("drive-to-event"), {"horizon_s": 60}), 1)
    assert episodes.run_row(run)["plugin_failures"] == 0
