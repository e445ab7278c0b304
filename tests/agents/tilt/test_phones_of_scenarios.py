"""A scenario names the stages of its phones; what it names wrongly is told before anything runs."""

import pytest

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import measures, simulate

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
    ("changes", "line"),
    [
        ({"phone.filter": "mean"}, "filter 'mean' is unknown; known: median, "),
        ({"phone.mapping": "cubic"}, "mapping 'cubic' is unknown; known: absolute, "),
        ({"phone.mapping_options.leak_s": 1}, "mapping 'absolute' has no option 'leak_s'; "),
        ({"phone.accelerometer": "adxl"}, "accelerometer 'adxl' not found; did you mean 'adxl3"),
        ({"phone.noise_mps2": 1}, "phone: unknown key 'noise_mps2'; "),
    ],
)
def test_a_wrong_stage_is_refused_before_the_run(changes, line):
    with pytest.raises(ConfigError) as told:
        scenarios.build(scenarios.load("drive-to-event"), changes)
    assert line in str(told.value)


@pytest.mark.parametrize(
    ("key", "told"),
    [
        ("phone.mapping_options.x", "mapping 'absolute' has no option 'x'; known: gain, "),
        ("phone.filter_options.window", "filter 'median': option 'window' is 0; should be "),
        ("operator.options.x", "operator 'adaptive' has no option 'x'; known: closed"),
        ("dispatch.options.x", "policy 'min_eta' has no option 'x'; it has none"),
    ],
)
def test_an_option_is_placed_where_it_stands_and_nowhere_if_it_came_as_a_change(
    key, told, tmp_path
):
    part, options, name = key.split(".")
    file = tmp_path / "scenario.yaml"
    file.write_text(f"horizon_s: 20\n{part}:\n  {options}:\n    {name}: 0\n")
    plain = tmp_path / "plain.yaml"
    plain.write_text(f"horizon_s: 20\n{part}: {{}}\n")
    with pytest.raises(ConfigError) as in_file:
        scenarios.build(load_yaml(file))
    assert str(in_file.value).startswith(f"{file}:4:5: {told}")
    with pytest.raises(ConfigError) as changed:
        scenarios.build(load_yaml(plain), {key: 0})
    assert str(changed.value).startswith(told)


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
    assert [d.outcome for d in simulate(built, 1).recorder.drives] == ["confirmed"]


@pytest.mark.parametrize(
    ("stage", "key", "body"),
    [
        (
            "Filter",
            "phone.filter",
            "    def value(self): return 1 / 0\n    def add(self, s): pass\n",
        ),
        (
            "Mapping",
            "phone.mapping",
            "    def command(self, level, turn, dt): return 1 / 0\n"
            "    def tilt_for(self, wanted, shown, within): return wanted\n",
        ),
    ],
)
def test_a_stage_that_fails_is_told_at_once_and_counted_in_the_row_of_its_run(
    stage, key, body, tmp_path
):
    file = tmp_path / "mine.py"
    file.write_text(f"from dva_sim.agents.tilt import {stage}\nclass Mine({stage}):\n{body}")
    run = simulate(
        scenarios.build(scenarios.load("drive-to-event"), {key: f"{file}:Mine", "horizon_s": 60}), 1
    )
    told = [moment for moment in run.recorder.timeline if "holds a phone" in moment.what]
    line = "holds a phone that fails: ZeroDivisionError: division by zero"
    assert [moment.what for moment in told] == [line] * sum(
        d.started is not None for d in run.recorder.drives
    )
    begun = run.recorder.drives[0].started
    assert begun is not None
    assert begun <= told[0].time < begun + 3.0
    assert measures.run_row(run)["plugin_failures"] > 100


def test_in_a_run_of_shipped_parts_no_plugin_fails():
    run = simulate(scenarios.build(scenarios.load("drive-to-event"), {"horizon_s": 60}), 1)
    assert measures.run_row(run)["plugin_failures"] == 0
