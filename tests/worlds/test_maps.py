import math

import numpy as np
import pytest
import shapely
from data.make_maps import hall, racks, ragged
from helpers.paths import TESTS
from helpers.worlds.small_map import write_map
from PIL import Image

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import with_named_files
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.maps import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, load_ros_map, outline
from dva_sim.worlds.site import map_site

MAPS = TESTS / "data"
EACH_MAP = pytest.mark.parametrize(
    ("path", "most"),  # and its walls
    [(MAPS / "hall.yaml", 400), (MAPS / "racks.yaml", 800)],
    ids=["hall", "racks"],
)


def test_black_is_occupied_white_is_free_and_205_is_unknown(tmp_path):
    grid = load_ros_map(write_map(tmp_path, [[0, 254, 205]]))
    assert grid.cells.tolist() == [[OCCUPIED, FREE, UNKNOWN]]


def test_205_stays_unknown_even_when_the_free_threshold_is_above_its_shade(tmp_path):
    grid = load_ros_map(write_map(tmp_path, [[204, 205, 206]], free_thresh=0.25))
    assert grid.cells.tolist() == [[FREE, UNKNOWN, FREE]]


def test_thresholds_are_exclusive_on_both_sides(tmp_path):
    # Occupancy is (255 - shade) / 255: 0.8 for 51, 0.2 for 204.
    path = write_map(tmp_path, [[50, 51, 52, 203, 204, 206]], occupied_thresh=0.8, free_thresh=0.2)
    states = [OCCUPIED, UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN, FREE]
    assert load_ros_map(path).cells.tolist() == [states]


def test_negate_swaps_black_and_white(tmp_path):
    grid = load_ros_map(write_map(tmp_path, [[0, 255, 120]], negate=1))
    assert grid.cells.tolist() == [[FREE, OCCUPIED, UNKNOWN]]


@pytest.mark.parametrize("negate", [1, "true", "True", "yes"])
def test_50_is_unknown_in_a_negated_map_whatever_the_thresholds(tmp_path, negate):
    grid = load_ros_map(write_map(tmp_path, [[0, 50, 255]], negate=negate, free_thresh=0.25))
    assert grid.cells.tolist() == [[FREE, UNKNOWN, OCCUPIED]]


@pytest.mark.parametrize(
    "image",
    ["/home/robot/maps/map.pgm", "~/nowhere/map.pgm", "C:\\\\maps\\\\map.pgm", "maps/map.pgm"],
)
def test_an_image_whose_path_is_of_another_machine_is_found_beside_its_map(tmp_path, image):
    path = write_map(tmp_path, [[0, 254]], image=f'"{image}"')
    assert load_ros_map(path).cells.tolist() == [[OCCUPIED, FREE]]
    assert tmp_path / "map.pgm" in with_named_files(path)


def test_a_mode_may_be_in_capitals(tmp_path):
    grid = load_ros_map(write_map(tmp_path, [[0, 100]], mode="Raw"))
    assert grid.cells.tolist() == [[FREE, OCCUPIED]]


def test_raw_mode_reads_percent_and_takes_the_rest_for_unknown(tmp_path):
    grid = load_ros_map(write_map(tmp_path, [[0, 100, 40, 255]], mode="raw"))
    assert grid.cells.tolist() == [[FREE, OCCUPIED, UNKNOWN, UNKNOWN]]


def test_the_last_image_row_is_the_lowest_in_y(tmp_path):
    grid = load_ros_map(write_map(tmp_path, [[0, 0], [254, 0]], origin="[10, 20, 0]"))
    assert grid.state_at(10.25, 20.25) == FREE
    assert grid.state_at(10.25, 20.75) == OCCUPIED
    assert grid.state_at(9.9, 20.25) == UNKNOWN


def test_scale_mode_tells_free_occupied_and_what_lies_between(tmp_path):
    path = write_map(tmp_path, [[254, 128, 0, 205]], mode="scale")
    assert load_ros_map(path).cells.tolist() == [[FREE, UNKNOWN, OCCUPIED, UNKNOWN]]
    path = write_map(tmp_path, [[205]], mode="scale", free_thresh=0.25)
    assert load_ros_map(path).cells.tolist() == [[FREE]]  # 205 means unknown in trinary maps only


def test_transparent_pixels_are_unknown_in_scale_mode(tmp_path):
    path = write_map(tmp_path, [[0]], mode="scale", image="map.png")
    pixels = np.array([[[254, 254, 254, 255], [254, 254, 254, 0]]], np.uint8)
    Image.fromarray(pixels).save(tmp_path / "map.png")
    assert load_ros_map(path).cells.tolist() == [[FREE, UNKNOWN]]


@pytest.mark.parametrize("turn", [0.3, -2.0, math.pi])
def test_points_of_a_turned_map_find_their_cell_again(tmp_path, turn):
    path = write_map(tmp_path, np.full((4, 7), 254), origin=f"[3, -2, {turn}]")
    grid = load_ros_map(path)
    for row, column in ((0, 0), (3, 6), (2, 1)):
        assert grid.to_cell(*grid.to_xy(row + 0.5, column + 0.5)) == (row, column)
    walls = outline(grid, grid.cells == FREE)
    assert np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum() == pytest.approx(2 * (2.0 + 3.5))


def test_a_quarter_turn_of_the_origin_turns_the_map(tmp_path):
    path = write_map(tmp_path, [[254, 0, 0]], origin=f"[1, 2, {math.pi / 2}]")
    grid = load_ros_map(path)
    assert grid.state_at(0.75, 2.25) == FREE
    assert grid.state_at(0.75, 2.75) == OCCUPIED
    assert grid.to_xy(0.5, 0.5) == pytest.approx([0.75, 2.25])


def test_clearance_is_the_distance_to_the_next_wall_or_unknown_cell():
    cells = np.full((9, 21), FREE, np.uint8)
    cells[:, 0], cells[:, -1] = OCCUPIED, UNKNOWN
    grid = OccupancyGrid(0.1, Pose(0, 0, 0), np.pad(cells, ((30, 30), (0, 0)), mode="edge"))
    assert grid.clearance_at(0.55, 3.5) == pytest.approx(0.45)
    assert grid.clearance_at(1.75, 3.5) == pytest.approx(0.25)


def test_the_reachable_area_leaves_out_what_lies_behind_a_narrow_gap():
    cells = np.full((20, 40), FREE, np.uint8)
    cells[:, 25] = OCCUPIED
    cells[9:11, 25] = FREE  # 0.2 m wide
    grid = OccupancyGrid(0.1, Pose(0, 0, 0), cells)
    reached = grid.reachable(0.3)
    assert reached[10, 10]
    assert not reached[10, 33]


def test_a_rectangle_has_an_outline_of_four_segments():
    cells = np.full((10, 10), UNKNOWN, np.uint8)
    cells[2:5, 3:9] = FREE
    grid = OccupancyGrid(0.1, Pose(0, 0, 0), cells)
    walls = outline(grid, cells == FREE)
    assert len(walls) <= 5  # a ring may start within a side
    assert np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum() == pytest.approx(1.8)


def test_a_map_of_noise_is_refused(tmp_path):
    shades = np.where(np.random.default_rng(1).random((1200, 1200)) < 0.9, 254, 0)
    path = write_map(tmp_path, shades, resolution=0.5)
    with pytest.raises(ConfigError, match=r"map.yaml:.*walls of 4\d\d,\d\d\d straight pieces"):
        map_site(path, 1, 1, 1)


def test_places_on_a_bare_map_depend_on_the_seed_and_not_on_the_size_of_the_team(tmp_path):
    path = write_map(tmp_path, np.full((40, 60), 254), resolution=0.2)
    small, large = map_site(path, 5, 1, 1), map_site(path, 5, 3, 2)
    assert large.robot_bases[:1] == small.robot_bases
    assert large.guard_posts[:1] == small.guard_posts
    assert map_site(path, 6, 1, 1).robot_bases != small.robot_bases
    assert {d.kind for d in small.detectors} == {"smoke", "gas", "water"}


def test_a_square_kilometre_without_walls_has_few_larger_blocks_and_few_detectors(tmp_path):
    site = map_site(write_map(tmp_path, np.full((250, 250), 254), resolution=4), 1, 0, 0)
    assert 1000 < len(site.compartments) < 2100
    assert 3000 < len(site.detectors) < 6600


@pytest.mark.parametrize("draw", [hall, racks])
def test_the_maps_for_tests_are_what_their_script_makes(draw):
    with Image.open(MAPS / f"{draw.__name__}.png") as image:
        assert (np.asarray(image) == ragged(draw())).all()


@EACH_MAP
def test_a_recorded_map_becomes_a_site_with_free_bases(path, most):
    site = map_site(path, 3, robots=3, guards=2)
    reached = site.grid.reachable(0.30)
    for pose in (*site.robot_bases, *site.guard_posts):
        assert site.is_free(pose.x, pose.y, 0.30)
        assert reached[site.grid.to_cell(pose.x, pose.y)]


def borders(grid, floor):
    """Edges between floor and other cells: one shapely line each."""
    inside = np.pad(floor, 1)
    low, row = np.argwhere(inside[1:, 1:-1] != inside[:-1, 1:-1]), np.array([[0, 0], [0, 1]])
    left, column = np.argwhere(inside[1:-1, 1:] != inside[1:-1, :-1]), np.array([[0, 0], [1, 0]])
    cells = np.vstack([low[:, None] + row, left[:, None] + column])
    return shapely.linestrings(grid.to_xy(cells[..., 0], cells[..., 1]))


def farthest(lines, others):
    """Largest distance from points on `lines` to the nearest of `others` [m]."""
    many, share = np.repeat(lines, 5), np.tile(np.arange(5) / 4, len(lines))
    points = shapely.line_interpolate_point(many, share, normalized=True)
    _, gaps = shapely.STRtree(others).query_nearest(points, return_distance=True, all_matches=False)
    return gaps.max()


@EACH_MAP
def test_the_walls_of_a_recorded_map_are_few_true_to_a_cell_and_closed(path, most):
    site = map_site(path, 1, robots=0, guards=0)
    walls = shapely.linestrings(site.walls.reshape(-1, 2, 2))
    edges = borders(site.grid, site.grid.floor(0.30))
    assert len(walls) < most < len(edges) / 8
    assert farthest(walls, edges) < 1.01 * site.grid.resolution
    assert farthest(edges, walls) < 1.01 * site.grid.resolution
    _, ends = np.unique(np.round(site.walls.reshape(-1, 2), 6), axis=0, return_counts=True)
    assert not (ends % 2).any()  # no wall ends in the open: nothing leaks
