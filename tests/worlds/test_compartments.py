import numpy as np
import pytest
from helpers.paths import TESTS

from dva_sim.worlds.compartments import of_floor, of_rooms
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.maps import FREE, OCCUPIED, OccupancyGrid, rasterise
from dva_sim.worlds.site import load_site, map_site
from dva_sim.worlds.site_parts import Room

MAPS = TESTS / "data"


def box(name, xmin, ymin, xmax, ymax, **more):
    corners = np.array([(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax)], float)
    return Room(name, corners, **more)


def split(rooms, walls, ways=()):
    import shapely

    lines = np.array(walls, float).reshape(-1, 4)
    floor = shapely.union_all([shapely.Polygon(room.polygon) for room in rooms])
    return of_rooms(rasterise(floor, lines, 0.05), rooms, lines, ways)


def described(opening):
    return {opening.room_a, opening.room_b}, opening.kind, round(opening.width, 2)


def test_the_openings_of_caparica_are_its_fifteen_doors_and_two_open_corridor_ends():
    site = load_site("caparica")
    doors = [o for o in site.openings if o.kind == "door"]
    borders = [o for o in site.openings if o.kind == "border"]
    assert len(doors) == len(site.doors) == 15
    assert ({"Server room", "Control room"}, "door", 1.1) in map(described, doors)
    assert ({"Main corridor", "Canteen"}, "door", 1.3) in map(described, doors)
    assert sorted(map(described, borders), key=lambda border: sorted(border[0])) == [
        ({"Main corridor", end}, "border", 2.2) for end in ("North corridor", "South corridor")
    ]
    for opening in doors:
        middle = (opening.x1 + opening.x2) / 2, (opening.y1 + opening.y2) / 2
        for name in (opening.room_a, opening.room_b):
            corners = site.room(name).polygon
            assert np.all(corners.min(axis=0) - 0.01 <= middle)
            assert np.all(middle <= corners.max(axis=0) + 0.01)


def test_the_compartments_of_caparica_are_its_rooms_and_are_found_by_a_point():
    site, rng = load_site("caparica"), np.random.default_rng(3)
    assert [c.name for c in site.compartments] == [room.name for room in site.rooms]
    assert sum(c.area for c in site.compartments) == pytest.approx(40 * 24, abs=0.1)
    for _ in range(200):
        x, y = site.sample_free(rng, 0.1)
        assert site.compartments[site.compartment_at(x, y)].name == site.room_at(x, y)
    assert site.compartment_at(-5, 3) is None
    assert site.compartment_at(1e6, 0) is None


def test_a_border_without_a_wall_is_open_over_its_whole_length_and_to_the_lower_ceiling():
    rooms = [box("a", 0, 0, 4, 4, ceiling=3.5), box("b", 4, 0, 8, 4, ceiling=2.6)]
    around = [(0, 0, 8, 0), (8, 0, 8, 4), (8, 4, 0, 4), (0, 4, 0, 0)]
    (opening,) = split(rooms, around).openings
    assert described(opening) == ({"a", "b"}, "border", 4.0)
    assert opening.height == 2.6
    (lower,) = split(rooms, [*around, (4, 1.5, 4, 4)]).openings
    assert described(lower) == ({"a", "b"}, "border", 1.5)


def test_a_walled_border_is_closed_even_when_it_is_drawn_three_centimetres_beside_it():
    rooms = [box("a", 0, 0, 4, 4), box("b", 4, 0, 8, 4)]
    assert split(rooms, [(4.03, 0, 4.03, 4)]).openings == ()


def test_outdoors_is_nobodys_air_and_a_door_to_it_leads_to_none():
    rooms = [box("hall", 0, 0, 4, 4), box("path", 4, 0, 8, 4, outdoor=True)]
    ways = [((4, 1, 4, 2), 2.1, "exit"), ((0, 1, 0, 2), 2.0, "door")]
    found = split(rooms, [(4, 0, 4, 1), (4, 2, 4, 4)], ways)
    assert [c.name for c in found.compartments] == ["hall"]
    assert [(o.room_a, o.room_b, o.kind, o.height) for o in found.openings] == [
        ("hall", None, "exit", 2.1),
        ("hall", None, "door", 2.0),
    ]


def grid_of(cells, resolution=0.1):
    return OccupancyGrid(resolution, Pose(0, 0, 0), cells)


def test_a_bare_hall_of_sixteen_by_eight_metres_is_two_blocks_with_one_opening():
    grid = grid_of(np.full((80, 160), FREE, np.uint8))
    found = of_floor(grid, grid.cells == FREE)
    assert [c.area for c in found.compartments] == pytest.approx([64, 64])
    (opening,) = found.openings
    assert opening[2:6] == pytest.approx((8, 0, 8, 8))
    assert (opening.room_a, opening.room_b, opening.width) == ("block 1", "block 2", 8.0)


def test_a_wall_inside_a_block_parts_it():
    cells = np.full((80, 80), FREE, np.uint8)
    cells[:, 40] = OCCUPIED
    grid = grid_of(cells)
    found = of_floor(grid, grid.cells == FREE)
    assert [c.area for c in found.compartments] == pytest.approx([32, 31.2])
    assert found.openings == ()


def test_a_nook_of_less_than_four_square_metres_belongs_to_its_neighbour():
    cells = np.full((80, 170), OCCUPIED, np.uint8)
    cells[:, :95] = FREE
    cells[10:, 85:] = OCCUPIED  # all that lies in the second block is 1 m x 1 m
    found = of_floor(grid_of(cells), cells == FREE)
    assert [c.area for c in found.compartments] == pytest.approx([69])
    assert (found.labels >= 0).sum() == (cells == FREE).sum()


def test_all_floor_of_a_map_as_robots_record_them_is_one_network_of_blocks():
    site = map_site(MAPS / "hall.yaml", 1, robots=1, guards=1)
    floor = site.grid.floor(0.30)
    assert sum(c.area for c in site.compartments) == pytest.approx(floor.sum() * 0.05**2)
    reached = {site.compartments[0].name}
    for _ in site.compartments:
        reached |= {o.room_a for o in site.openings if o.room_b in reached}
        reached |= {o.room_b for o in site.openings if o.room_a in reached}
    assert reached == {c.name for c in site.compartments}
    assert all(4 <= c.area <= 100 for c in site.compartments)


def test_a_look_up_finds_the_first_area_around_a_point_as_a_search_does():
    rng, site = np.random.default_rng(8), load_site("campus")
    for x, y in rng.uniform((-20, -20), (140, 110), (2000, 2)).tolist():
        names = [room.name for room in site.rooms if room.contains(x, y)]
        assert site.room_at(x, y) == (names[0] if names else None)
