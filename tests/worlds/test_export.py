import numpy as np
import pytest
import shapely
from helpers.paths import TESTS
from helpers.wording import unnamed
from PIL import Image

from dva_sim.cli import site
from dva_sim.worlds.site import load_site, map_site
from dva_sim.worlds.site_export import write_site

MAPS = TESTS / "data"


def sides(walls):
    """Segments in either direction, to a millimetre."""
    return {frozenset(map(tuple, np.round(w.reshape(2, 2), 3).tolist())) for w in walls}


def far(a, b):
    """Largest difference between two lists of poses [m, rad]."""
    return max(np.abs(np.subtract(x[:3], y[:3])).max() for x, y in zip(a, b, strict=True))


@pytest.mark.parametrize("name", ["caparica", "campus"])
def test_a_site_written_and_read_again_is_the_same_to_a_millimetre(tmp_path, name):
    site = load_site(name)
    again = load_site(write_site(site, tmp_path))
    assert sides(again.walls) == sides(site.walls)
    assert np.abs(again.doors - site.doors).max() < 1e-3
    for one, two in zip(site.rooms, again.rooms, strict=True):
        assert (one.name, one.ceiling, one.outdoor) == (two.name, two.ceiling, two.outdoor)
        assert np.abs(one.polygon - two.polygon).max() < 1e-3
    for one, two in zip((*site.zones, *site.wifi), (*again.zones, *again.wifi), strict=True):
        assert np.abs(one.polygon - two.polygon).max() < 1e-3
    assert [w.quality for w in again.wifi] == [w.quality for w in site.wifi]
    assert [z.use for z in again.zones] == [z.use for z in site.zones]
    for what in ("robot_bases", "guard_posts", "operator_desks", "exits", "cameras"):
        assert far(getattr(site, what), getattr(again, what)) < 1e-3
    assert [(d.name, d.kind) for d in again.detectors] == [(d.name, d.kind) for d in site.detectors]
    assert [o[:2] for o in again.openings] == [o[:2] for o in site.openings]
    assert np.mean(again.grid.cells == site.grid.cells) > 0.999


def test_a_ros_map_becomes_a_drawn_site_with_one_room_and_the_same_walls(tmp_path):
    site = map_site(MAPS / "hall.yaml", 1, robots=0, guards=0)
    again = load_site(write_site(site, tmp_path))
    assert [room.name for room in again.rooms] == ["Floor"]
    old, new = (shapely.multilinestrings(s.walls.reshape(-1, 2, 2)) for s in (site, again))
    assert shapely.union_all(new).within(shapely.buffer(old, 1e-3))
    assert shapely.union_all(old).within(shapely.buffer(new, 1e-3))
    both = again.grid.reachable(0.3).sum() * again.grid.resolution**2
    # Its cells are larger: along the walls some floor is lost.
    assert both == pytest.approx(site.grid.reachable(0.3).sum() * 0.05**2, rel=0.04)


# --- dva-sim site ----------------------------------------------------------------------


def test_show_draws_a_site_and_says_what_it_is(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    site.show("caparica", None, [], coverage=False, width=400)
    line, file = capsys.readouterr().out.splitlines()
    counts = "15 rooms", "15 doors", "4 exits", "3 robot bases", "3 guard posts", "2 operator desks"
    more = "28 detectors", "3 cameras", "112 wall segments"
    assert unnamed(line, "caparica", "40.0 m", "24.0 m", *counts, *more) == []
    assert file == "caparica.png"
    with Image.open(tmp_path / file) as picture:
        assert picture.width == 400


def test_show_takes_options_of_a_generated_site_and_a_file(tmp_path, capsys):
    site.show(
        "office-block", tmp_path / "x.png", ["width_m=24", "depth_m=12"], coverage=True, width=400
    )
    assert unnamed(capsys.readouterr().out, "office-block", "24.0 m", "12.0 m") == []
    assert (tmp_path / "x.png").stat().st_size > 10_000


def test_show_draws_a_map(tmp_path):
    site.show(str(MAPS / "hall.yaml"), tmp_path / "hall.png", [], coverage=False, width=400)
    assert (tmp_path / "hall.png").stat().st_size > 1_000
