import math
import runpy

import numpy as np
import pytest
from helpers.paths import ROOT
from helpers.worlds.small_site import TWO_ROOMS, feature, square, write_site

from dva_sim.worlds.geojson import write_features
from dva_sim.worlds.maps import FREE
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import load_site
from dva_sim.worlds.site_parts import QUALITIES

WORLDS = ROOT / "worlds"


def site_of(folder, *features, **changes):
    return load_site(write_site(folder, [*TWO_ROOMS, *features], **changes))


def test_rooms_have_the_ceiling_of_the_site_unless_they_say(tmp_path):
    tall = feature("room", "Polygon", square(0, 4, 4), name="tall", ceiling_m=6)
    site = site_of(tmp_path, tall, ceiling_m=2.7)
    assert {room.name: room.ceiling for room in site.rooms} == {"west": 2.7, "east": 2.7, "tall": 6}


def test_doors_have_a_height(tmp_path):
    low = feature("door", "LineString", [(4, 3), (4, 3.8)], height_m=1.9)
    site = site_of(tmp_path, low)
    assert site.door_heights == (2.1, 1.9)
    assert [opening.height for opening in site.openings] == [2.1, 1.9]


def test_an_exit_with_nothing_beyond_leads_out_but_lets_no_robot_off_the_plan(tmp_path):
    site = site_of(tmp_path, feature("exit", "LineString", [(8, 1), (8, 2)], name="east exit"))
    (way,) = site.exits
    assert way.name == "east exit"
    assert (way.x, way.y, way.width) == pytest.approx((8, 1.5, 1.0), abs=2e-3)
    assert way.heading == pytest.approx(0, abs=1e-2)
    assert ("east", None, "exit") in [(o.room_a, o.room_b, o.kind) for o in site.openings]
    assert not Planner(site, 0.3).line_of_sight((7, 1.5), (9, 1.5))


@pytest.mark.parametrize("ends", [[(8, 1), (8, 2.2)], [(8, 2.2), (8, 1)]])
def test_an_exit_onto_a_path_is_open_and_points_outwards_however_it_is_drawn(tmp_path, ends):
    path = feature("path", "Polygon", square(8, 0, 4))
    site = site_of(tmp_path, path, feature("exit", "LineString", ends))
    assert site.exits[0].heading == pytest.approx(0, abs=1e-2)
    assert Planner(site, 0.3).distance((6, 1.6), (10, 1.6)) == pytest.approx(4, abs=0.2)
    assert site.room_at(10, 2) == "Path 1"
    assert site.room("Path 1").outdoor
    assert site.compartment_at(10, 2) is None


def test_a_yard_drawn_around_everything_lies_below_rooms_and_paths(tmp_path):
    yard = feature("yard", "Polygon", square(-4, -4, 16), name="lawn")
    path = feature("path", "Polygon", square(8, 0, 4), name="path")
    site, rng = site_of(tmp_path, yard, path), np.random.default_rng(1)
    assert [site.room_at(x, 2) for x in (2, 6, 10, -2)] == ["west", "east", "path", "lawn"]
    assert [room.paved for room in site.rooms if room.outdoor] == [True, False]
    for _ in range(100):
        assert site.room_at(*site.sample_free(rng, 0.3, "lawn")) == "lawn"


def test_zones_cameras_and_base_stations_are_read(tmp_path):
    site = site_of(
        tmp_path,
        feature("zone", "Polygon", square(1, 1, 1), name="dock", use="charging"),
        feature("camera", "Point", [(1, 1)], heading_deg=90, field_of_view_deg=60, range_m=12),
        feature("base_station", "Point", [(2, 2)], radio="lte"),
        feature("heat_detector", "Point", [(3, 3)]),
        feature("co_detector", "Point", [(3, 2)], name=7),
    )
    assert (site.zones[0].name, site.zones[0].use) == ("dock", "charging")
    assert site.zones[0].contains(1.5, 1.5)
    (camera,) = site.cameras
    assert camera.field_of_view == pytest.approx(math.pi / 3)
    assert (camera.heading, camera.range) == pytest.approx((math.pi / 2, 12))
    assert camera.name == "camera-1"
    assert site.base_stations[0].radio == "lte"
    assert [(d.name, d.kind) for d in site.detectors] == [("heat-1", "heat"), ("7", "co")]


def test_wifi_is_a_word_numbers_or_both_and_the_later_covers_the_earlier(tmp_path):
    site = site_of(
        tmp_path,
        feature("wifi", "Polygon", square(0, 0, 8), quality="fair"),
        feature("wifi", "Polygon", square(0, 0, 2), loss=0.3),
        feature("wifi", "Polygon", square(4, 0, 2), quality="poor", extra_delay_s=0.2),
    )
    assert site.link_quality(3, 3).quality == QUALITIES["fair"]
    assert site.link_quality(1, 1).quality == (0.3, 20e6, 0.0)
    assert site.link_quality(5, 1).quality == (0.10, 1e6, 0.2)
    assert site.link_quality(9, 9) is None
    assert [area.grade for area in site.wifi] == ["fair", "poor", "poor"]


def test_what_an_editor_adds_of_its_own_is_left_alone(tmp_path):
    odd = feature("zone", "Polygon", square(1, 1, 1), fid=3, stroke="#fff", name=None)
    assert site_of(tmp_path, odd).zones[0].name == "zone-1"


# --- the shipped campus ----------------------------------------------------------------


def test_the_campus_file_is_what_its_script_draws(tmp_path):
    script = runpy.run_path(str(WORLDS / "draw_campus.py"))
    write_features(tmp_path / "campus.geojson", script["campus"](), load_site("campus").frame)
    drawn = (tmp_path / "campus.geojson").read_text(encoding="utf-8")
    assert drawn == (WORLDS / "campus.geojson").read_text(encoding="utf-8")


def test_a_robot_reaches_every_room_path_and_lawn_of_the_campus():
    site = load_site("campus")
    reached = site.grid.reachable(0.30)
    for room in site.rooms:
        floor = reached[site.grid.window(room.polygon)].sum() * site.grid.resolution**2
        assert floor > 2.0, room.name
    for pose in (*site.robot_bases, *site.guard_posts, *site.operator_desks):
        assert reached[site.grid.to_cell(pose.x, pose.y)]


def test_the_campus_has_gates_houses_with_exits_and_wifi_with_weak_spots():
    site = load_site("campus")
    assert site.extent == pytest.approx((0, 0, 120, 90), abs=0.01)
    assert sum("gate" in way.name for way in site.exits) == 4
    out = [o for o in site.openings if o.kind == "exit"]
    assert len(out) == len(site.exits) - 4
    assert all(o.room_b is None for o in out)
    grades = [site.link_quality(*at).grade for at in ((30, 66), (59, 60), (58, 15), (110, 65))]
    assert sorted(grades) == ["fair", "good", "none", "poor"]
    for detector in site.detectors:
        assert site.compartment_at(detector.x, detector.y) is not None
    for thing in (*site.cameras, *site.base_stations):
        assert site.grid.state_at(thing.x, thing.y) == FREE


def test_a_way_across_the_campus_leaves_one_house_and_enters_another():
    site = load_site("campus")
    bay, lab = site.robot_bases[0], (15.0, 64.0)
    way = Planner(site, 0.30).path((bay.x, bay.y), lab)
    rooms = list(dict.fromkeys(site.room_at(x, y) for x, y in way.tolist()))
    assert rooms[0] == "Robot bay"
    assert rooms[-1] == "Robotics lab"
    assert any(room and "avenue" in room for room in rooms) or "Promenade" in rooms
