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
from dva_sim.kernel.yaml_files import load_yaml

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


KEPT = json.loads((ROOT / "experiments/answers/which-messaging.json").read_text())
SECTION = " ".join(PAGE.partition("## One result")[2].partition("## Next steps")[0].split())
LINKS = KEPT["map"][1:]


def cells_of(pattern):
    """Cells of a pattern's column of the kept map, by link."""
    column = KEPT["map"][0].index(pattern)
    return {row[0]: row[column] for row in LINKS}


def test_where_nothing_is_shown_to_differ_is_counted_first():
    (few, every) = re.search(r"On (\d+) of (\d+) links", SECTION).groups()
    assert SECTION.strip().startswith(f"On {few} of {every} links")
    nothing = [row for row in LINKS if row[1].startswith("nothing")]
    assert (int(few), int(every)) == (len(nothing), len(LINKS))
    sure = [set(row[1].replace(" and ", ", ").split(", ")) for row in LINKS if row not in nothing]
    assert set.intersection(*sure) == set()


def test_means_of_the_map_are_those_of_the_kept_answer_and_called_means():
    assert f"{cells_of('REQ/REP')['very far (1 s)']} s over the table's four" in SECTION
    main = json.loads((ROOT / "experiments/answers/req-rep-vs-pub-sub.json").read_text())
    means = re.search(r"\+([\d.]+) to \+([\d.]+).s at a one-way delay of 1.s", main["answer"])
    least, greatest = (round(float(mean)) for mean in means.groups())
    assert f"REQ/REP costs {least} to {greatest} s on average over 36 models" in SECTION
    greatest = max(
        float(cell.split()[-1]) for cell in cells_of("paced").values() if cell[-1].isdigit()
    )
    assert f"cost {greatest:.0f} s on average" in SECTION
    assert f"means of {KEPT['persons']} simulated persons" in SECTION
    assert "extrapolated" in SECTION


def test_limits_are_ends_of_bands_over_all_ways_of_steering():
    at = KEPT["beside"][0].index("behind at most [s]")
    for pattern, text in (("paced", "cost at most {} s"), ("REQ/REP", "REQ/REP: {} s")):
        ends = {row[0]: float(row[at]) for row in KEPT["beside"] if row[1] == pattern}
        assert max(ends, key=ends.__getitem__) == "very far (1 s)"
        assert text.format(round(max(ends.values()))) in SECTION


def test_most_drives_by_publishing_never_arrive_on_the_narrow_links():
    """The median over persons is the horizon under every way of steering."""
    names = {"plain PUB/SUB", "latest-wins", "acknowledged"}
    medians = [row[2] for row in KEPT["beside"] if row[0].startswith("narrow") and row[1] in names]
    assert medians == ["600"] * 6


def test_speed_and_rate_of_the_table_are_those_of_its_scenario():
    manifest = json.loads((ROOT / "experiments/answers/which-messaging.manifest.json").read_text())
    assert manifest["scenarios"]["drive"]["command"]["rate_hz"] == 10
    robot = load_yaml(ROOT / "agents/robots/servrobot.yaml").data["max_speed_mps"]
    assert f"Robot: {robot} m/s, 10 commands a second" in SECTION


@pytest.mark.soak
def test_another_speed_or_rate_lets_as_many_arrive_as_is_said(tmp_path):
    profile = (ROOT / "agents/robots/servrobot.yaml").read_text()
    (tmp_path / "fast.yaml").write_text(profile.replace("max_speed_mps: 0.5", "max_speed_mps: 1.0"))
    narrow = {
        "persons": 5,
        "factors.link": ["narrow (60 ms, 40 kbit/s)"],
        "factors.messaging": ["pub-sub", "latest-wins", "acknowledged"],
    }
    arrived = {}
    for name, change in (
        ("slow", {"command.rate_hz": 5}),
        ("fast", {"robot.profile": str(tmp_path / "fast.yaml")}),
    ):
        runs = dva_sim.run(
            "which-messaging", tmp_path / name, set=narrow | change, report=False
        ).runs
        own = ~np.asarray(runs["is_reference"], dtype=bool)
        confirmed = np.asarray(runs["confirmed"], dtype=float)
        steady = own & (np.asarray(runs["steering"]) == "throughout")
        arrived[name] = [(int(confirmed[k].sum()), int(k.sum())) for k in (own, steady)]
    assert arrived["slow"][0] == (60, 60)
    assert "all 60 tried do" in SECTION
    (some, every), (steady, steered) = arrived["fast"]
    assert f"{some} of {every}, and {steady} of the {steered} steered continuously" in SECTION


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
