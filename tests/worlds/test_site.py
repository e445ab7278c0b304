import math

import numpy as np
import pytest
from helpers.wording import unnamed
from helpers.worlds.small_site import TWO_ROOMS, feature, square, write_site

from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import load_site

# --- the shipped site ------------------------------------------------------------------


def test_every_room_of_caparica_is_reached_from_every_base_by_a_robot():
    site = load_site("caparica")
    planner, rng = Planner(site, 0.30), np.random.default_rng(1)
    for room in site.rooms:
        goal = site.sample_free(rng, 0.35, room.name)
        assert site.room_at(*goal) == room.name
        for base in site.robot_bases:
            assert math.isfinite(planner.distance((base.x, base.y), goal))


@pytest.mark.parametrize("name", ["caparica", "hall"])
def test_a_robot_gets_to_the_place_that_stands_for_a_room(name):
    site = load_site(name)
    planner = Planner(site, 0.30)
    base = site.robot_bases[0]
    for room in site.rooms:
        place = site.place_in(room.name)
        assert place is not None
        assert site.room_at(*place) == room.name
        assert math.isfinite(planner.distance((base.x, base.y), place))


def test_a_room_behind_a_wall_has_no_place(tmp_path):
    closed = feature("room", "Polygon", square(20, 20, 3), name="vault")
    site = load_site(write_site(tmp_path, [*TWO_ROOMS, closed]))
    assert site.place_in("east") is not None
    assert site.place_in("vault") is None


def test_bases_posts_and_desks_of_caparica_stand_free():
    site = load_site("caparica")
    for pose in (*site.robot_bases, *site.guard_posts, *site.operator_desks):
        assert site.is_free(pose.x, pose.y, 0.30)
    assert {site.room_at(d.x, d.y) for d in site.operator_desks} == {"Control room"}


def test_caparica_is_an_institute_of_40_by_24_metres_with_doors_a_robot_can_pass():
    site = load_site("caparica")
    assert site.extent == pytest.approx((0, 0, 40, 24), abs=0.01)
    assert len(site.rooms) == 12 + 3
    widths = np.hypot(*(site.doors[:, 2:] - site.doors[:, :2]).T)
    assert widths.min() >= 1.09
    assert widths.max() <= 1.31
    for detector in site.detectors:
        assert site.room_at(detector.x, detector.y) is not None


def test_an_unknown_room_is_refused_with_the_rooms_there_are():
    with pytest.raises(ConfigError, match=r"'Archives'.*'Archive'"):
        load_site("caparica").room("Archives")


# --- the format ------------------------------------------------------------------------


def test_a_door_opens_the_wall_it_lies_on(tmp_path):
    site = load_site(write_site(tmp_path, TWO_ROOMS))
    planner = Planner(site, 0.30)
    assert planner.line_of_sight((3, 2), (5, 2))
    assert not planner.line_of_sight((3, 3), (5, 3))
    assert planner.distance((1, 2), (7, 2)) == pytest.approx(6, abs=0.1)


def test_without_the_door_the_rooms_are_apart(tmp_path):
    site = load_site(write_site(tmp_path, TWO_ROOMS[:-1]))
    assert Planner(site, 0.30).path((1, 2), (7, 2)) is None


def test_a_wall_drawn_as_an_area_is_solid(tmp_path):
    shelf = feature("wall", "Polygon", square(1, 1, 1.5))
    site = load_site(write_site(tmp_path, [*TWO_ROOMS, shelf]))
    assert not site.is_free(1.75, 1.75, 0.0)
    assert site.is_free(3.2, 1.75, 0.3)


def test_poses_have_their_heading_in_radians(tmp_path):
    base = feature("robot_base", "Point", [(1, 1)], heading_deg=90)
    site = load_site(write_site(tmp_path, [*TWO_ROOMS, base]))
    assert site.robot_bases[0] == pytest.approx((1, 1, math.pi / 2), abs=1e-3)


def test_samples_have_their_clearance_in_rooms_behind_doors_narrower_than_it(tmp_path):
    site, rng = load_site(write_site(tmp_path, TWO_ROOMS)), np.random.default_rng(2)
    for _ in range(50):
        x, y = site.sample_free(rng, 0.5, "east")
        assert site.room_at(x, y) == "east"
        assert site.is_free(x, y, 0.5)
    with pytest.raises(ConfigError, match="3 m radius"):
        site.sample_free(rng, 3.0)


KNOT = [(0, 0), (2, 2), (2, 0), (0, 2), (0, 0)]


@pytest.mark.parametrize(
    ("wrong", "names"),
    [
        (feature("robot_base", "Point", [(0.1, 1)]), "robot_base 0.3 m"),
        (feature("window", "LineString", [(0, 0), (1, 1)]), "kind 'window' wall room"),
        (feature("room", "Polygon", square(0, 4, 2), name="west"), "room name 'west'"),
        (feature("wall", "Point", [(1, 1)]), "wall LineString MultiLineString Polygon"),
        (feature("room", "Polygon", KNOT, name="knot"), "room self-intersection"),
        ({"type": "Feature"}, "'kind'"),
    ],
)
def test_a_mistake_in_a_plan_is_told_with_line_and_column(tmp_path, wrong, names):
    with pytest.raises(ConfigError) as error:
        load_site(write_site(tmp_path, [*TWO_ROOMS, wrong]))
    assert unnamed(error.value, "tiny.geojson:", "feature 6", *names.split()) == []
    assert error.value.line > 100


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({"plan": "gone.geojson"}, "tiny.yaml:3:1: plan 'gone.geojson'"),
        ({"plam": "x"}, "'plam'; 'plan'?"),
        ({"origin": "{latitude: 138, longitude: 0}"}, "tiny.yaml:2:10: origin.latitude"),
    ],
)
def test_a_mistake_in_a_site_file_is_told_with_its_place(tmp_path, changes, names):
    with pytest.raises(ConfigError) as error:
        load_site(write_site(tmp_path, TWO_ROOMS, **changes))
    assert unnamed(error.value, *names.split()) == []


def test_a_plan_that_is_not_json_is_told_with_line_and_column(tmp_path):
    path = write_site(tmp_path, TWO_ROOMS)
    (tmp_path / "tiny.geojson").write_text('{"type": "FeatureCollection",\n "features": [}')
    with pytest.raises(ConfigError, match=r"tiny.geojson:2:15: "):
        load_site(path)


def test_a_missing_site_is_refused_with_the_sites_there_are():
    with pytest.raises(ConfigError, match=r"'atlantis' .*caparica"):
        load_site("atlantis")
