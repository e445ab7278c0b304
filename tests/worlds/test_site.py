import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.worlds.small_site import TWO_ROOMS, feature, square, write_site

from dva_sim.cli.site import describe
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


@pytest.mark.parametrize("name", ["caparica", "office-block"])
def test_a_robot_gets_to_the_floor_near_any_point_that_has_some(name):
    site = load_site(name)
    planner = Planner(site, 0.30)
    base = site.robot_bases[0]
    west, south, east, north = site.extent
    found = 0
    for x in np.linspace(west, east, 8):
        for y in np.linspace(south, north, 8):
            place = site.floor_near(x, y, 2.0)
            if place is not None:
                found += 1
                assert math.dist(place, (x, y)) <= 2.0
                assert site.room_at(x, y) in (None, site.room_at(*place))
                assert math.isfinite(planner.distance(place, (base.x, base.y)))
    assert found > 40


def test_free_floor_is_its_own_place_and_that_of_a_desk_is_before_it():
    site = load_site("caparica")
    assert site.floor_near(20.0, 12.0, 2.0) == (20.0, 12.0)
    (x, y), *_ = site.solids[0]
    desk = (x + 0.05, y + 0.05)
    place = site.floor_near(*desk, 2.0)
    assert place is not None
    assert place != desk
    assert site.is_free(*place, 0.30)


def test_floor_behind_a_wall_is_not_nearby(tmp_path):
    vault = [
        feature("room", "Polygon", square(8, 0, 3), name="vault"),
        feature("wall", "LineString", square(8, 0, 3)),
    ]
    site = load_site(write_site(tmp_path, [*TWO_ROOMS, *vault]))
    assert site.floor_near(7.5, 2.0, 2.0) == (7.5, 2.0)
    assert site.floor_near(8.5, 2.0, 2.0) is None


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


def test_a_name_that_controls_a_terminal_is_shown_with_escapes():
    site = replace(load_site("caparica"), name="\x1b[31m")
    assert describe(site).startswith("\\x1b[31m: 40.0 m")
