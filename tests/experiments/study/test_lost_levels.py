"""Levels that differ by rounding alone, and levels that settings leave out."""

import pytest
from helpers.processes.command_line import call
from helpers.wording import unnamed

from dva_sim.experiments.study.loading import load_study, write_study


@pytest.fixture
def mine(tmp_path):
    return write_study(str(tmp_path / "mine"))


def test_levels_that_are_merely_near_are_two(mine):
    assert load_study(mine, ["factors.link.delay_s=[0.2, 0.20001, 0.5]"]).lost == ()


def test_a_contrast_that_settings_take_half_of_is_told_before_any_run(mine, tmp_path):
    ended = call("run", mine, "--dry-run", "--set", "factors.pattern=req-rep", cwd=tmp_path)
    assert ended.returncode == 0
    warned = [line for line in ended.stderr.splitlines() + ended.stdout.splitlines()
              if line.startswith("warning: ")]  # fmt: skip
    assert unnamed(warned[0], "answer", "'latest-wins'", "'pattern'") == []
    assert unnamed(warned[1], "'waiting-costs'") == []


def test_settings_that_leave_all_that_is_declared_lose_nothing(mine):
    assert load_study(mine, ["persons=2", "factors.link.delay_s=[0, 0.25, 0.5]"]).lost == ()


LINKS = "factors.link=[near (10 ms), cellular]"


def test_a_map_goes_on_without_notes_on_levels_that_are_left_out():
    left = load_study("which-messaging", [LINKS])
    assert (left.map.models, left.map.notes, left.lost) == ("steering", {}, ())


def test_a_map_that_settings_leave_nothing_of_is_told():
    left = load_study("which-messaging", [LINKS, "factors.steering=[throughout, in-moves]"])
    assert left.map is None
    assert unnamed(left.lost[-1], "map") == []
