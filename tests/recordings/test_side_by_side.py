"""One run under two patterns: told, and drawn as it is asked for."""

from io import StringIO
from pathlib import Path

import pytest
from helpers.wording import unnamed
from PIL import Image
from rich.console import Console

from dva_sim.cli.stories import episode
from dva_sim.experiments.report.episode import EpisodeRequest
from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.pictures import Wanted

pytestmark = pytest.mark.system

SHORT = ["horizon_s=12", "link.delay_s=0.1"]


def output_of(pictures: Wanted | None = None, patterns: str = "req-rep,latest-wins") -> str:
    reported = StringIO()
    where = Console(file=reported, width=120)
    episode(EpisodeRequest("drive-to-event", 2, SHORT, patterns, pictures or Wanted()), where)
    return reported.getvalue()


def test_without_any_picture_both_stories_are_told_and_how_they_ended_beside_each_other():
    reported = output_of()
    assert reported.count("robot-1 to event 1") == 2
    headings = ("req-rep, 100 ms each way", "latest-wins, 100 ms each way", "side by side")
    places = [reported.index(f" {heading}") for heading in headings]
    assert places == sorted(places)
    ends = [line.partition("  ") for line in reported[places[-1] :].splitlines()[1:]]
    assert [name for name, _, _ in ends] == ["REQ/REP", "latest-wins PUB/SUB"]
    assert all(unnamed(end, "not confirmed", "12 s") == [] for _, _, end in ends)


def test_a_still_and_a_strip_show_both(tmp_path):
    reported = output_of(Wanted(still=tmp_path / "one.png", strip=tmp_path / "more.png", panels=2))
    assert "Still: " in reported
    assert "Strip: " in reported
    with Image.open(tmp_path / "one.png") as one, Image.open(tmp_path / "more.png") as more:
        assert one.width == more.width == 1680
        assert more.height > 1.5 * one.height  # a row for each moment


def test_a_camera_is_one_of_one_run():
    eye = Wanted(still=Path("eye.png"), camera="robot-1")
    with pytest.raises(ConfigError, match=r"--camera .*--side-by-side"):
        output_of(eye)


def test_the_same_pattern_may_stand_on_both_sides():
    assert output_of(patterns="pub-sub,pub-sub").count("plain PUB/SUB") == 2
