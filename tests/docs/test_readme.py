"""The first page shows what the program does, and names numbers of a kept answer."""

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from helpers import page_runs
from helpers.paths import ROOT
from PIL import Image

import dva_sim

pytestmark = pytest.mark.system

README = ROOT / "README.md"
PAGE = README.read_text(encoding="utf-8")
SHOWN = ROOT / "docs/pictures/one-second-away.png"


def one_drive(picture: Path):
    """Draw the drive of the first picture again."""
    patterns, late = "req-rep,latest-wins", {"link.delay_s": 1}
    return dva_sim.episode(
        "drive-to-event", seed=11, set=late, side_by_side=patterns, still=picture
    )


def test_the_page_can_be_read_in_a_few_minutes():
    assert len(PAGE.split()) <= 800


def test_commands_of_the_page_work(tmp_path):
    page_runs.run(README, tmp_path)


@pytest.mark.parametrize("target", re.findall(r"\bmake ([a-z-]+)", PAGE))
def test_targets_of_the_page_are_ones_that_make_knows(target):
    tried = subprocess.run(["make", "-n", target], cwd=ROOT, capture_output=True, check=False)
    assert tried.returncode == 0


def test_the_picture_is_what_the_run_draws(tmp_path):
    one_drive(tmp_path / "drawn.png")
    with Image.open(SHOWN) as shown, Image.open(tmp_path / "drawn.png") as drawn:
        assert shown.size == drawn.size
        apart = np.asarray(shown.convert("L"), int) - np.asarray(drawn.convert("L"), int)
    assert (np.abs(apart) > 64).mean() < 0.002


def test_the_text_of_the_picture_has_the_times_of_the_run():
    confirmed, ahead = re.findall(r"after ([\d.]+) s|, (\d+) s ahead", PAGE)
    patterns = {"req-rep": 0.0, "latest-wins": 0.0}
    for pattern in patterns:
        late = {"link.delay_s": 1, "pattern": pattern}
        run = dva_sim.episode("drive-to-event", seed=11, set=late)
        patterns[pattern] = run.measures["drive_time_s"]
    assert round(patterns["req-rep"] - patterns["latest-wins"]) == int(ahead[1])
    assert float(confirmed[0]) > patterns["latest-wins"]


def test_numbers_of_the_map_are_those_of_the_kept_answer():
    kept = json.loads((ROOT / "experiments/answers/which-messaging.json").read_text())
    found = re.findall(r"([^:;,]*?):? ([\d.]+)\ss\b", kept["answer"])
    costs = {name.rpartition("that of ")[2].strip(): cost for name, cost in found}
    section = PAGE.partition("## One result")[2].partition("## Next steps")[0]
    (worst,) = re.findall(r"REQ/REP costs up to (\d+) s", section)
    assert int(worst) == round(float(costs["REQ/REP"]))
    assert f"REQ/REP {costs['REQ/REP']} s, very far (1 s)" in kept["answer"].replace("\xa0", " ")
    (paced,) = re.findall(r"at most\s+(\d+) s", section)
    assert int(paced) == round(float(costs["paced requests"]))
    for publishing in ("plain PUB/SUB", "latest-wins PUB/SUB", "acknowledged"):
        assert f"{publishing} never done" in kept["answer"]
    assert "extrapolated" in section


def test_python_of_the_page_runs_on_a_small_study(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (code,) = [block.text for block in page_runs.blocks_of(README) if block.language == "python"]
    small = 'dva_sim.run("how-late-at-250-ms", set={"persons": 2, "stop": None}, jobs=1)'
    shortened = code.replace('dva_sim.run("how-late-at-250-ms")', small)
    assert shortened != code
    values = {}
    exec(compile(shortened, "README.md", "exec"), values)
    assert len(values["results"].runs["drive_time_s"]) == 4
    assert values["results"].answer.lead in capsys.readouterr().out
