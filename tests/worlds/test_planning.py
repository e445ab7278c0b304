import gc
import itertools
import math
import weakref
from dataclasses import replace

import numpy as np
import pytest
from helpers.paths import TESTS
from helpers.worlds.hall_with_people import hall
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from dva_sim.worlds.geo import Pose
from dva_sim.worlds.line_of_sight import Sight
from dva_sim.worlds.maps import UNKNOWN, OccupancyGrid
from dva_sim.worlds.planning import KEPT_AROUND, KEPT_MAPS, Disc, Planner
from dva_sim.worlds.site import FOOTPRINT, load_site, map_site

MAPS = TESTS / "data"


def with_door(middle, width):
    """A wall across the hall at x = 5 with one opening."""
    return [(5, 0, 5, middle - width / 2), (5, middle + width / 2, 5, 10)]


def length(path):
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def densely(path):
    return np.concatenate([np.linspace(a, b, 20) for a, b in itertools.pairwise(path)])


def test_in_the_open_the_way_is_straight():
    planner = Planner(hall(10, 10), 0.3)
    path = planner.path((1.5, 2.0), (8.5, 7.0))
    assert path[0] == pytest.approx((1.5, 2.0))
    assert path[-1] == pytest.approx((8.5, 7.0))
    assert length(path) == pytest.approx(math.dist((1.5, 2), (8.5, 7)), rel=0.01)


@pytest.mark.parametrize("middle", np.arange(5.0, 5.25, 0.03))
def test_a_door_of_one_metre_is_passed_near_its_middle_wherever_it_lies(middle):
    planner = Planner(hall(10, 10, with_door(middle, 1.0)), 0.3)
    path = densely(planner.path((1, 1), (9, 1)))
    crossing = path[np.argmin(np.abs(path[:, 0] - 5))]
    assert crossing[1] == pytest.approx(middle, abs=0.12)


def test_a_way_around_a_wall_is_hardly_longer_than_the_shortest():
    planner = Planner(hall(10, 10, [(5, 0, 5, 6)]), 0.3)
    shortest = math.dist((2, 2), (5, 6.3)) + math.dist((5, 6.3), (8, 2))
    assert shortest < planner.distance((2, 2), (8, 2)) < 1.15 * shortest


@pytest.mark.parametrize("clearance", [0.2, 0.3, 0.4])
def test_ways_through_caparica_keep_their_clearance(clearance):
    site, rng = load_site("caparica"), np.random.default_rng(4)
    planner = Planner(site, clearance)
    for _ in range(5):
        start, goal = site.sample_free(rng, 0.5), site.sample_free(rng, 0.5)
        path = planner.path(start, goal)
        assert min(site.grid.clearance_at(x, y) for x, y in densely(path)) > clearance - 0.05


def test_a_corridor_is_followed_in_its_middle():
    site = load_site("caparica")
    path = Planner(site, 0.3).path((3.0, 12.0), (37.0, 12.4))
    assert np.abs(path[20:-20, 1] - 12.0).max() < 0.35


def test_behind_a_closed_wall_there_is_no_way():
    planner = Planner(hall(10, 10, [(5, 0, 5, 10)]), 0.3)
    assert planner.path((2, 2), (8, 2)) is None
    assert planner.distance((2, 2), (8, 2)) == math.inf


def test_an_opening_narrower_than_the_body_is_no_way():
    site = hall(10, 10, with_door(5.0, 0.5))
    assert Planner(site, 0.3).path((2, 5), (8, 5)) is None
    assert Planner(site, 0.15).path((2, 5), (8, 5)) is not None


def test_an_end_close_to_a_wall_is_joined_on_its_own_side():
    planner = Planner(hall(10, 10, with_door(8.0, 1.0)), 0.3)
    path = planner.path((4.9, 2.0), (5.1, 2.0))
    assert length(path) > 10


def test_a_site_without_free_floor_has_no_ways():
    grid = OccupancyGrid(0.1, Pose(0, 0, 0), np.full((30, 30), UNKNOWN, np.uint8))
    assert Planner(replace(hall(10, 10), grid=grid), 0.3).path((1, 1), (2, 2)) is None


def test_a_way_is_the_same_in_a_new_planner_and_whatever_was_asked_before():
    first, second = hall(10, 10, with_door(3, 1.0)), hall(10, 10, with_door(3, 1.0))
    busy = Planner(first, 0.3)
    busy.path((2, 2), (9, 9))
    again = Planner(second, 0.3).path((1, 8), (9, 1))
    assert busy.path((1, 8), (9, 1)).tobytes() == again.tobytes()


def test_walls_block_sight_and_openings_do_not():
    planner = Planner(hall(10, 10, with_door(5.0, 1.0)), 0.3)
    assert planner.line_of_sight((2, 5), (8, 5))
    assert not planner.line_of_sight((2, 3), (8, 3))
    assert planner.line_of_sight((2, 3), (4, 9))


def test_on_a_map_as_robots_record_them_all_bases_reach_each_other():
    site = map_site(MAPS / "hall.yaml", 2, robots=3, guards=1)
    planner = Planner(site, 0.3)
    for base in site.robot_bases:
        assert math.isfinite(planner.distance(base[:2], site.guard_posts[0][:2]))


def test_a_way_keeps_its_clearance_from_what_the_plan_does_not_show():
    planner = Planner(hall(10, 10), 0.3)
    start, goal = (1.5, 5.0), (8.5, 5.0)
    around = densely(planner.path(start, goal, [Disc(5.0, 5.0, 0.4), Disc(5.0, 6.0, 0.4)]))
    for y in (5.0, 6.0):
        assert np.hypot(*(around - (5.0, y)).T).min() > 0.4 + 0.3 - 0.1
    assert length(around) < 1.15 * math.dist(start, goal)
    assert length(planner.path(start, goal)) == pytest.approx(7.0, rel=0.01)  # nothing is kept


def test_of_a_map_with_obstacles_few_fields_are_kept():
    planner = Planner(load_site("campus"), 0.3)
    for x in range(12):
        planner.path((1.0 + x, 1.0), (30.0 + 4 * x, 20.0), [Disc(20.0, 20.0, 0.4)])
    around = planner._roadmap.around((Disc(20.0, 20.0, 0.4),))
    kept = around._field_of.cache_info()
    assert kept.misses > kept.currsize > 0
    assert kept.currsize * around._room.size <= KEPT_AROUND


def test_maps_with_obstacles_that_are_no_longer_cached_are_freed_at_once():
    roadmap = Planner(hall(20, 20), 0.3)._roadmap
    gc.disable()
    try:
        maps = [
            weakref.ref(roadmap.around((Disc(5.0, 5.0 + 0.1 * n, 0.4),)))
            for n in range(KEPT_MAPS + 3)
        ]
        for each in maps[-KEPT_MAPS:]:
            each().way((2.0, 2.0), (8.0, 8.0))
        assert [each() is not None for each in maps] == [False] * 3 + [True] * KEPT_MAPS
    finally:
        gc.enable()


def test_who_stands_in_the_only_door_leaves_no_way_and_one_beside_the_plan_changes_nothing():
    planner = Planner(hall(10, 10, with_door(5.0, 1.0)), 0.3)
    assert planner.path((1, 5), (9, 5), [Disc(5.0, 5.0, 0.3)]) is None
    assert len(planner.path((1, 5), (9, 5), [Disc(500.0, 5.0, 0.3)])) > 2


def test_the_room_around_a_point_is_its_distance_from_the_nearest_wall():
    planner = Planner(hall(10, 10), 0.3)
    room = planner.room_at(np.array([(5.0, 5.0), (5.0, 1.0), (9.5, 5.0)]))
    assert room == pytest.approx([5.0, 1.0, 0.5], abs=0.06)


@pytest.mark.parametrize("off", [0.0, 3.6e-15, -3.6e-15, 1e-9, -1e-9])
def test_who_stands_on_the_line_of_a_wall_up_to_rounding_is_behind_it_for_nobody(off):
    sight = Sight(np.array([[0.0, 24.0, 40.0, 24.0]]))
    on_line = (13.1, 24.0 + off)
    for side in (23.0, 25.0):
        assert sight.between((13.1, side), on_line)
        assert sight.from_point(on_line, np.array([[13.1, side]])).all()
    assert not sight.between((13.1, 23.0), (13.1, 24.001))
    assert not sight.from_point((13.1, 23.0), np.array([[13.1, 24.001]])).any()


@pytest.mark.parametrize("name", ["caparica", "office-block"])
def test_a_search_finds_the_costs_and_the_ways_of_an_undirected_one_among_equal_ways_too(name):
    roadmap = Planner(load_site(name), FOOTPRINT)._roadmap
    count = roadmap._graph.shape[0]
    rows = np.repeat(np.arange(count), np.diff(roadmap._graph.indptr))
    there = roadmap._graph.indices > rows  # each edge once
    ends = rows[there].astype(np.int32), roadmap._graph.indices[there]
    once = csr_array((roadmap._graph.data[there], ends), shape=(count, count))
    for goal in np.random.default_rng(1).choice(np.unique(rows), 5).tolist():
        found = roadmap._field(goal)
        known = dijkstra(once, directed=False, indices=goal, return_predecessors=True)
        assert all(map(np.array_equal, found, known))
