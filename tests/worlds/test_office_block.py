import itertools
import math

import numpy as np
import pytest
import shapely
from helpers.processes.search_settings import search
from hypothesis import example, given
from hypothesis import strategies as st

from dva_sim.worlds.maps import FREE
from dva_sim.worlds.office_block import OfficeBlock, assign, lay_out, office_block
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import load_site

few = search(4)
blocks = st.fixed_dictionaries(
    {
        "seed": st.integers(0, 10_000),
        "width_m": st.floats(24, 90),
        "depth_m": st.floats(12, 60),
        "robot_bases": st.integers(1, 12),
        "guard_posts": st.integers(1, 12),
    }
)
SMALLEST = {
    "seed": 3,
    "width_m": 24.0,
    "depth_m": 12.0,
    "robot_bases": 12,
    "guard_posts": 12,
}


@pytest.mark.system
@few
@given(blocks)
@example(SMALLEST)
def test_a_robot_reaches_every_room_and_exit_of_every_block(options):
    site = load_site("office-block", options)
    reached = site.grid.reachable(0.30)
    for room in site.rooms:
        window = site.grid.window(room.polygon)
        assert reached[window].sum() * 0.05**2 > 1.5, room.name
    for way in site.exits:
        x, y = way.x - 0.6 * math.cos(way.heading), way.y - 0.6 * math.sin(way.heading)
        assert reached[site.grid.to_cell(x, y)], way.name
    for pose in (*site.robot_bases, *site.guard_posts, *site.operator_desks):
        assert reached[site.grid.to_cell(pose.x, pose.y)]


@few
@given(blocks)
@example(SMALLEST)
def test_every_room_of_a_block_but_the_ways_has_one_door_in_its_wall(options):
    site = load_site("office-block", options)
    doors = [o for o in site.openings if o.kind == "door"]
    assert len(doors) == len(site.doors)
    behind = {name for door in doors for name in (door.room_a, door.room_b)}
    rooms = {room.name: shapely.Polygon(room.polygon) for room in site.rooms}
    for door in doors:
        line = shapely.LineString([door[2:4], door[4:6]])
        assert 0.95 <= door.width <= 1.401
        assert all(rooms[n].exterior.distance(line) < 1e-6 for n in (door.room_a, door.room_b))
    ways = {name for name in rooms if "orridor" in name or name == "Lobby"}
    assert behind - ways == rooms.keys() - ways
    assert all((d.room_a in ways) != (d.room_b in ways) for d in doors)


@few
@given(blocks)
def test_rooms_and_corridors_are_as_wide_as_people_build_them(options):
    layout = lay_out(options["width_m"], options["depth_m"], np.random.default_rng(options["seed"]))
    for cell in layout.cells:
        assert cell.width >= 2.8 - 1e-9
        assert 3.2 <= cell.depth <= 9.0
    for x1, low, x2, high in layout.corridors:
        assert (x1, x2) == (0.0, layout.width)
        assert 2.0 - 1e-9 <= high - low <= 2.6 + 1e-9
    for x1, _, x2, _ in itertools.chain(*layout.crossings):
        assert 2.0 - 1e-9 <= x2 - x1 <= 2.6 + 1e-9


LARGEST = {"seed": 1, "width_m": 300.0, "depth_m": 200.0}
sizes = st.fixed_dictionaries(
    {"seed": st.integers(0, 10_000), "width_m": st.floats(24, 300), "depth_m": st.floats(12, 200)}
)


@few
@given(sizes)
@example(LARGEST)
def test_no_two_rooms_of_any_block_have_one_name_and_the_number_tells_the_corridor(options):
    layout = lay_out(options["width_m"], options["depth_m"], np.random.default_rng(options["seed"]))
    rooms = assign(layout, bases=4)
    assert len({name for _, _, name in rooms}) == len(rooms) == len(layout.cells)
    numbered = [(cell, int(name.split()[-1])) for cell, _, name in rooms if name[-3:].isdigit()]
    reported = (
        all(n // hundred == cell.wing + 1 for cell, n in numbered) for hundred in (100, 1000)
    )
    assert any(reported)


def test_the_largest_block_there_is_names_each_of_its_1800_rooms_otherwise():
    features = office_block(OfficeBlock(**LARGEST))
    names = [f.properties["name"] for f in features if f.kind == "room"]
    assert len(set(names)) == len(names) > 1700


@few
@given(blocks)
@example(SMALLEST)
def test_a_block_has_as_many_bases_posts_and_desks_as_asked_apart_from_each_other(options):
    site = load_site("office-block", options)
    assert len(site.robot_bases) == options["robot_bases"]
    assert len(site.guard_posts) == options["guard_posts"]
    assert len(site.operator_desks) == 2
    for poses, gap in ((site.robot_bases, 0.9), (site.guard_posts, 0.9)):
        assert all(math.dist(a[:2], b[:2]) >= gap for a, b in itertools.combinations(poses, 2))
    assert {site.room_at(b.x, b.y)[:9] for b in site.robot_bases} == {"Robot bay"}
    assert {site.room_at(d.x, d.y) for d in site.operator_desks} == {"Control room"}


@pytest.mark.parametrize("kind", ["Server room", "Toilets", "Plant room", "Kitchen", "Stairs A"])
def test_a_block_of_sixty_by_forty_metres_has_what_a_house_needs(kind):
    assert kind in {room.name for room in load_site("office-block").rooms}


def test_detectors_and_cameras_hang_where_the_floor_is_free():
    site = load_site("office-block", {"seed": 5})
    assert {d.kind for d in site.detectors} == {"smoke", "heat", "co", "gas", "water"}
    for thing in (*site.detectors, *site.cameras):
        assert site.grid.state_at(thing.x, thing.y) == FREE
    assert {zone.use for zone in site.zones} == {"restricted", "charging"}


def plain(features):
    return [(f.kind, f.shape.wkt, dict(f.properties)) for f in features]


def test_the_same_seed_gives_the_same_house_and_another_seed_another():
    one = plain(office_block(OfficeBlock(seed=4, width_m=70, depth_m=30)))
    assert one == plain(office_block(OfficeBlock(seed=4, width_m=70, depth_m=30)))
    assert one != plain(office_block(OfficeBlock(seed=5, width_m=70, depth_m=30)))


def test_more_robots_do_not_move_a_wall():
    few_, many = load_site("office-block"), load_site("office-block", {"guard_posts": 12})
    assert np.array_equal(few_.walls, many.walls)


@pytest.mark.system
def test_a_block_of_120_by_60_metres_is_planned_from_end_to_end():
    site = load_site("office-block", {"width_m": 120, "depth_m": 60})
    planner = Planner(site, 0.30)
    start, goal = site.exits[0], site.exits[-1]
    way = planner.path((start.x + 1, start.y), (goal.x, goal.y - 1))
    assert way is not None
