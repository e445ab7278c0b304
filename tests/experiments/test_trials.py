from pathlib import Path

import pytest
from rich.console import Console

from dva_sim.config import load_yaml
from dva_sim.errors import ConfigError
from dva_sim.experiments import console, trials
from dva_sim.experiments.pictures import Wanted
from dva_sim.resources import find
from dva_sim.tasks import build

FOLDER = "experiments/scenarios/tasks"


def task(name, **changes):
    return build(load_yaml(find(name, FOLDER)), {"trials": 1, "practice": 0, **changes})


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("fitts-tilt", {"task.amplitude_m": 0.085}),
        ("move-and-wait", {"operator.strategy": "pursuit"}),
        ("steering-law", {"task.shape": "circular", "task.width_m": 0.01}),
        ("slalom", {"task.cones": 2, "task.spacing_m": 4.0}),
    ],
)
def test_a_trial_can_be_drawn(tmp_path, name, changes):
    path = tmp_path / "trial.png"
    trials.draw(task(name, **changes), seed=1, path=path)
    assert path.read_bytes().startswith(b"\x89PNG")


def test_a_block_is_told_with_its_conditions_and_what_they_come_to():
    out = Console(record=True, width=200)
    trials.tell(task("fitts-lag", **{"task.amplitude_m": 0.05}), seed=1, console=out)
    text = out.export_text()
    assert "amplitude_m" in text
    assert "4 trials: 100 % done" in text
    assert "bit/s" in text


@pytest.mark.parametrize("wanted", [{"video": Path("x.gif")}, {"strip": Path("x.png")}])
def test_a_task_has_no_film(wanted):
    with pytest.raises(ConfigError, match="is a task: only --still shows something"):
        console.episode("tasks/corner", 1, [], None, Wanted(**wanted))
