"""Plans as other programs write them."""

import json
import math

import numpy as np
import pytest
import shapely
from helpers.wording import unnamed
from helpers.worlds.small_site import TWO_ROOMS, feature, square, write_site

from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import load_site
from dva_sim.worlds.site_export import write_site as export

HOLE = [(3, 1), (3, 3), (1, 3), (1, 1), (3, 1)]
INSIDE, BESIDE = (2.0, 2.0), (0.5, 2.0)


def site_of(tmp_path, *features):
    return load_site(write_site(tmp_path, list(features)))


def holed(kind, outer=None, **properties):
    """A feature whose shape has a hole of 2 m x 2 m."""
    drawn = feature(kind, "Polygon", outer or square(0, 0, 4), **properties)
    inner = feature(kind, "Polygon", HOLE)["geometry"]["coordinates"]
    drawn["geometry"]["coordinates"] += inner
    return drawn


def mistake(tmp_path, *features, **members):
    """Error of a plan with these features and members."""
    folder = tmp_path / "mistaken"
    folder.mkdir()
    path = write_site(folder, list(features))
    plan = folder / "tiny.geojson"
    plan.write_text(json.dumps(json.loads(plan.read_text()) | members, indent=1))
    with pytest.raises(ConfigError) as error:
        load_site(path)
    return error.value


def test_nobody_is_in_the_hole_of_a_room_nor_gets_there(tmp_path):
    site = site_of(tmp_path, holed("room", name="hall"))
    assert site.room_at(*BESIDE) == "hall"
    assert site.room_at(*INSIDE) is None
    assert not site.is_free(*INSIDE, 0.0)
    assert site.ground_of(site.rooms[0]).area == pytest.approx(12, rel=1e-3)
    assert site.compartments[0].area == pytest.approx(12, rel=1e-3)
    assert site.compartment_at(*INSIDE) is None
    lines = shapely.multilinestrings(site.walls.reshape(-1, 2, 2))
    assert shapely.polygonize(list(lines.geoms)).area == pytest.approx(4, rel=1e-2)


def test_what_is_drawn_in_a_hole_is_ground_and_parted_by_no_wall(tmp_path):
    court = feature("yard", "Polygon", HOLE, name="court")
    site = site_of(tmp_path, holed("room", name="hall"), court)
    assert site.room_at(*INSIDE) == "court"
    assert len(site.walls) == 0
    assert math.isfinite(Planner(site, 0.3).distance(BESIDE, INSIDE))


def test_holes_of_zones_and_of_coverage_are_outside_them(tmp_path):
    site = site_of(
        tmp_path,
        feature("room", "Polygon", square(0, 0, 4), name="hall"),
        holed("zone", name="around"),
        holed("wifi", name="shade", quality="poor"),
    )
    assert [area.contains(*INSIDE) for area in (*site.zones, *site.wifi)] == [False, False]
    assert [area.contains(*BESIDE) for area in (*site.zones, *site.wifi)] == [True, True]
    assert site.link_quality(*INSIDE) is None


def test_a_solid_around_a_court_is_hollow(tmp_path):
    site = site_of(
        tmp_path, feature("room", "Polygon", square(-2, -2, 8), name="hall"), holed("wall")
    )
    assert site.is_free(*INSIDE, 0.3)
    assert not site.is_free(*BESIDE, 0.0)
    assert not Planner(site, 0.3).line_of_sight((-1, 2), INSIDE)
    pieces = [shapely.Polygon(solid) for solid in site.solids]
    assert sum(piece.area for piece in pieces) == pytest.approx(12, rel=1e-3)
    assert not any(piece.contains(shapely.Point(INSIDE)) for piece in pieces)
    assert len(site.wall_lines) == 0


def test_a_site_with_holes_is_written_as_it_is_read(tmp_path):
    site = site_of(tmp_path, holed("room", name="hall"), holed("zone", name="around"))
    again = load_site(export(site, tmp_path / "again"))
    assert np.array_equal(again.rooms[0].holes[0], site.rooms[0].holes[0])
    assert np.array_equal(again.zones[0].holes[0], site.zones[0].holes[0])
    assert np.array_equal(again.grid.cells, site.grid.cells)


def multiple(drawn, *others):
    """Geometry made one of several parts."""
    shape = drawn["geometry"]
    parts = [each["geometry"]["coordinates"] for each in (drawn, *others)]
    return drawn | {"geometry": {"type": f"Multi{shape['type']}", "coordinates": parts}}


def test_a_shape_of_one_part_is_read_as_that_part(tmp_path):
    base = feature("robot_base", "Point", [(1, 1)])
    door = TWO_ROOMS[-1]
    assert door["properties"]["kind"] == "door"
    plain = [*TWO_ROOMS, base]
    site = site_of(tmp_path, *map(multiple, plain))
    (tmp_path / "plain").mkdir()
    same = site_of(tmp_path / "plain", *plain)
    assert np.array_equal(site.grid.cells, same.grid.cells)
    assert site.robot_bases == same.robot_bases
    assert len(site.doors) == len(same.doors) == 1


def test_of_several_parts_walls_zones_and_coverage_take_all_and_rooms_none(tmp_path):
    hall = feature("room", "Polygon", square(0, 0, 9), name="hall")
    shelves = multiple(
        feature("wall", "Polygon", square(1, 1, 1)), feature("wall", "Polygon", square(5, 5, 1))
    )
    site = site_of(tmp_path, hall, shelves)
    assert not site.is_free(1.5, 1.5, 0.0)
    assert not site.is_free(5.5, 5.5, 0.0)
    problem = mistake(tmp_path, multiple(hall, feature("room", "Polygon", square(20, 0, 4))))
    assert unnamed(str(problem), "feature 1", "room", "2 parts") == []


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_a_byte_order_mark_is_no_part_of_a_plan(tmp_path, encoding):
    path = write_site(tmp_path, TWO_ROOMS)
    plan = tmp_path / "tiny.geojson"
    plan.write_text(plan.read_text(), encoding=encoding)
    assert len(load_site(path).rooms) == 2


def test_a_position_that_is_no_degrees_is_named_with_the_system_of_its_file(tmp_path):
    room = feature("room", "Polygon", square(0, 0, 4), name="hall")
    room["geometry"]["coordinates"][0][2] = [1_224_514.0, 6_106_854.0]
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}}
    problem = mistake(tmp_path, room, crs=crs)
    assert unnamed(str(problem), "feature 1", "1.22451e+06", "3857", "EPSG:4326") == []


@pytest.mark.parametrize(
    ("turn", "names"),
    [
        (lambda x, y: (x + 20, y), ["km from", "38.66", "-9.2"]),
        (lambda x, y: (x + 180, -y), ["12,7", "km from"]),  # to a plane it is near
        (lambda x, y: (y, x), ["longitude comes first"]),
    ],
    ids=["another country", "antipodes", "exchanged"],
)
def test_a_plan_far_from_its_origin_is_refused_with_the_distance(tmp_path, turn, names):
    room = feature("room", "Polygon", square(0, 0, 4), name="hall")
    ring = room["geometry"]["coordinates"][0]
    room["geometry"]["coordinates"] = [[turn(*position) for position in ring]]
    assert unnamed(str(mistake(tmp_path, room)), "feature 1", *names) == []


def test_a_mistake_among_thousands_of_features_is_told_at_its_line(tmp_path):
    wall = feature("wall", "LineString", [(0, 0), (4, 0)])
    typo = feature("gaurd_post", "Point", [(1, 1)])
    problem = mistake(tmp_path, *TWO_ROOMS, *[wall] * 3_000, typo, *[wall] * 1_000)
    assert unnamed(str(problem), f"feature {len(TWO_ROOMS) + 3_001}", "'guard_post'") == []
    lines = (tmp_path / "mistaken/tiny.geojson").read_text().splitlines()
    assert '"gaurd_post"' in "".join(lines[problem.line - 1 : problem.line + 8])
