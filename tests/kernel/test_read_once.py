"""Files are read once, and again when they have changed."""

import os

import pytest
from helpers.worlds.small_site import TWO_ROOMS, feature, square, write_site

from dva_sim.agents.robot.profile import load_robot
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.read_once import read_once
from dva_sim.network.link.recorded import read_trace
from dva_sim.worlds.site import load_site


def later(path, text):
    """Replace a file by a new one, as editors do."""
    new = path.with_name("new")
    new.write_text(text)
    new.replace(path)


def test_a_file_is_read_again_only_when_it_has_changed(tmp_path):
    read = []

    @read_once(lambda path: [path])
    def text_of(path, ending):
        read.append(path)
        return path.read_text() + ending

    path = tmp_path / "some.txt"
    later(path, "first")
    assert [text_of(path, "!") for _ in range(3)] == ["first!"] * 3
    assert text_of(path, "?") == "first?"
    assert len(read) == 2

    when = path.stat().st_mtime_ns
    later(path, "other")
    os.utime(path, ns=(when, when))  # of the same size and time, as an archive restores them
    assert text_of(path, "!") == "other!"
    assert text_of(path=path, ending="!") == "other!"
    assert len(read) == 4


def test_a_file_that_has_gone_is_not_there_any_more(tmp_path):
    path = tmp_path / "mine.up"
    later(path, "1\n2\n")
    assert len(read_trace(str(path))) == 2
    later(path, "1\n2\n3\n")
    assert len(read_trace(str(path))) == 3
    path.unlink()
    with pytest.raises(ConfigError, match="cannot be read"):
        read_trace(str(path))


def test_a_profile_that_was_edited_counts_at_once(tmp_path):
    path = tmp_path / "mine.yaml"
    for mass in (20.0, 30.0):
        later(path, f"mass_kg: {mass}")
        assert load_robot(str(path)).mass_kg == mass


def test_a_site_is_read_again_when_its_plan_has_changed(tmp_path):
    site = write_site(tmp_path, TWO_ROOMS)
    before = load_site(site)
    assert load_site(site) is before

    shelf = feature("wall", "Polygon", square(1, 1, 1.5))
    (tmp_path / "other").mkdir()
    write_site(tmp_path / "other", [*TWO_ROOMS, shelf])
    later(tmp_path / "tiny.geojson", (tmp_path / "other/tiny.geojson").read_text())
    assert before.is_free(1.75, 1.75, 0.0)
    assert not load_site(site).is_free(1.75, 1.75, 0.0)
