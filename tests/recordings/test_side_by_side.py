"""One run under two patterns: told, and drawn as it is asked for."""

from io import StringIO
from typing import Any

import pytest
from helpers.wording import unnamed
from PIL import Image
from rich.console import Console

from dva_sim.cli.stories import episode
from dva_sim.experiments.report.episode import EpisodeRequest
from dva_sim.options.runs import EpisodeOptions

pytestmark = pytest.mark.system

SHORT = ["horizon_s=12", "link.delay_s=0.1"]


def output_of(patterns: str = "req-rep,latest-wins", **pictures: Any) -> str:
    reported = StringIO()
    where = Console(file=reported, width=120)
    options = EpisodeOptions("drive-to-event", 2, set=SHORT, side_by_side=patterns, **pictures)
    episode(EpisodeRequest(options), where)
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


def test_a_still_shows_both(tmp_path):
    assert "Still: " in output_of(still=tmp_path / "one.png")
    with Image.open(tmp_path / "one.png") as one:
        assert one.width == 1680


def test_the_same_pattern_may_stand_on_both_sides():
    assert output_of(patterns="pub-sub,pub-sub").count("plain PUB/SUB") == 2
