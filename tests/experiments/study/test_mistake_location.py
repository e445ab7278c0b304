"""Location of mistakes: the `--set` that makes them, their key, or their file."""

import pytest

from dva_sim.kernel.config_overrides import build, parse_changes, set_by
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.scenario import Scenario


def test_settings_that_exclude_each_other_are_told_together(tmp_path):
    (tmp_path / "one.yaml").write_text("horizon_s: 60\n")
    document = load_yaml(tmp_path / "one.yaml")
    pairs = ["robot.count=0", "horizon_s=50", "guard.count=0"]
    with pytest.raises(ConfigError) as caught:
        build(Scenario, document, parse_changes(pairs), lambda s, _: s, lambda *_: None)
    # Without the first of them somebody can act; without the last nobody can either.
    assert caught.value.keys == ("robot.count",)
    assert str(set_by(pairs, caught.value)).startswith("--set robot.count=0: ")
