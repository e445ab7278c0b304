import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.worlds.hall_with_people import hall as bare_hall

from dva_sim.worlds.camera import Camera, Figure, SmokeView
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.hazards import Fire, Raster
from dva_sim.worlds.hazards.fire import HEAT_PER_AREA
from dva_sim.worlds.site import load_site
from dva_sim.worlds.site_parts import Exit, Room

EAST = 0.0
FOCAL = 160 / math.tan(math.radians(35))  # pixels: 320 across show 70 degrees


def hall(ceiling=3.0, extra=(), doors=()):
    """A hall from (0, 0) to (20, 10), perhaps with more walls and doors in it."""
    room = Room("Hall", np.array([(0, 0), (20, 0), (20, 10), (0, 10)], dtype=float))
    return replace(bare_hall(20, 10, extra, doors), rooms=(room,), ceiling=ceiling)


class Steady(Fire):
    """A fire that releases as much heat as its peak says, at once and for ever."""

    def heat_release(self, time):
        return self.peak


def burning(x, y, radius):
    """A fire of a radius [m]."""
    return Steady((x, y), 0.0, peak=HEAT_PER_AREA * math.pi * radius**2 or 1e-12)


def changed(a, b):
    """Rows and columns where two pictures differ."""
    return np.nonzero(np.abs(a.astype(int) - b.astype(int)).max(axis=2) > 12)


def air(value):
    """Uniform raster over the hall."""
    return Raster(np.full((20, 40), value), (0.0, 20.0, 0.0, 10.0), "")


def smoke(extinction, share=1.0):
    """A layer that fills this share of the hall's height, from the ceiling down."""
    return SmokeView(air(extinction * share), air(extinction))


def test_a_picture_has_its_size_and_eight_bits_a_colour():
    picture = Camera(hall()).picture(Pose(5, 5, EAST))
    assert picture.shape == (240, 320, 3)
    assert picture.dtype == np.uint8


@pytest.mark.parametrize("distance", [4.0, 5.0, 10.0])
@pytest.mark.parametrize("ceiling", [2.5, 3.0])
def test_a_wall_covers_its_height_times_focal_length_over_distance(distance, ceiling):
    picture = Camera(hall(ceiling)).picture(Pose(20 - distance, 5, EAST))
    column = picture[:, 160].astype(int).sum(axis=1)
    plaster = column[int(120 - 0.5 * FOCAL / distance)]  # 1.6 m above the floor
    skirting = column[int(120 + 1.05 * FOCAL / distance)]  # 0.05 m
    top, foot = np.flatnonzero(column == plaster)[0], np.flatnonzero(column == skirting)[-1]
    assert pytest.approx(FOCAL, abs=0.1) == 228.5
    assert foot + 1 - top == pytest.approx(ceiling * FOCAL / distance, abs=1.5)
    assert top == pytest.approx(120 - (ceiling - 1.1) * FOCAL / distance, abs=1)


def test_left_is_left():
    camera, pose = Camera(hall()), Pose(5, 5, EAST)
    bare = camera.picture(pose)
    _, left = changed(bare, camera.picture(pose, [Figure("guard", 8, 6)]))
    _, right = changed(bare, camera.picture(pose, [Figure("guard", 8, 4)]))
    assert left.max() < 160 < right.min()


@pytest.mark.parametrize("bearing_deg", [-30, -10, 0, 20])
@pytest.mark.parametrize("heading_deg", [0, 90, 200])
def test_a_person_at_three_metres_is_where_the_bearing_says(bearing_deg, heading_deg):
    camera, heading = Camera(hall()), math.radians(heading_deg)
    pose, angle = Pose(10, 5, heading), heading + math.radians(bearing_deg)
    # Somebody who faces the lens looks the same on both sides.
    figure = Figure("bystander", 10 + 3 * math.cos(angle), 5 + 3 * math.sin(angle), angle + math.pi)
    _, columns = changed(camera.picture(pose), camera.picture(pose, [figure]))
    middle = (columns.min() + columns.max() + 1) / 2
    assert middle == pytest.approx(160 - FOCAL * math.tan(math.radians(bearing_deg)), abs=3)


def test_a_person_of_a_metre_and_three_quarters_at_four_metres_is_a_hundred_pixels_tall():
    camera, pose = Camera(hall()), Pose(10, 5, EAST)
    rows, _ = changed(camera.picture(pose), camera.picture(pose, [Figure("guard", 14, 5, math.pi)]))
    assert np.ptp(rows) + 1 == pytest.approx(1.77 * FOCAL / 4, abs=3)
    assert rows.max() == pytest.approx(120 + 1.1 * FOCAL / 4, abs=2)


def test_a_person_behind_a_wall_is_not_seen():
    camera, pose = Camera(hall(extra=[(8, 0, 8, 10)])), Pose(5, 5, EAST)
    behind = camera.picture(pose, [Figure("guard", 9, 5), Figure("robot", 12, 6)])
    assert np.array_equal(behind, camera.picture(pose))


def test_a_person_behind_another_is_hidden_and_beside_is_not():
    camera, pose = Camera(hall()), Pose(5, 5, EAST)
    near = Figure("guard", 7, 5, math.pi)
    alone = camera.picture(pose, [near])
    behind = camera.picture(pose, [near, Figure("robot", 13, 5, math.pi)])
    beside = camera.picture(pose, [near, Figure("robot", 13, 7, math.pi)])
    assert len(changed(alone, behind)[0]) < 20 < len(changed(alone, beside)[0])
    assert np.array_equal(behind, camera.picture(pose, [Figure("robot", 13, 5, math.pi), near]))


def test_one_sees_through_a_door_but_not_through_its_lintel():
    wall = [(8, 0, 8, 4.4), (8, 5.6, 8, 10)]
    camera = Camera(hall(extra=wall, doors=[(8, 4.4, 8, 5.6)]))
    pose = Pose(5, 5, EAST)
    fire = camera.picture(pose, hazards=[burning(10, 5, 1.2)])
    flames = fire.astype(int) - camera.picture(pose)
    rows, columns = np.nonzero(flames[:, :, 0] > 60)
    lintel = 120 - (2.1 - 1.1) * FOCAL / 3
    assert rows.min() >= lintel - 1
    assert columns.min() >= 160 - 0.6 * FOCAL / 3 - 1
    assert columns.max() <= 160 + 0.6 * FOCAL / 3 + 1


def test_the_sign_over_a_door_reads_from_left_to_right_from_both_sides():
    parts = {"West": (0, 8), "East": (8, 20)}
    rooms = tuple(
        Room(name, np.array([(a, 0), (b, 0), (b, 10), (a, 10)], dtype=float))
        for name, (a, b) in parts.items()
    )
    site = hall(extra=[(8, 0, 8, 4.4), (8, 5.6, 8, 10)], doors=[(8, 4.4, 8, 5.6)])
    turned = hall(extra=[(8, 0, 8, 4.4), (8, 5.6, 8, 10)], doors=[(8, 5.6, 8, 4.4)])
    same = [Camera(replace(s, rooms=rooms)).picture(Pose(5, 5, EAST)) for s in (site, turned)]
    assert len(changed(*same)[0]) < 100  # but for a column more or less of letters
    sign = same[0][14:32, 118:202]
    assert len(np.unique(sign.reshape(-1, 3), axis=0)) > 20  # letters on a plate
    assert len(changed(sign, sign[:, ::-1])[0]) > 200  # that do not read both ways


@pytest.mark.parametrize("extinction", [0.1, 0.3, 0.6])
def test_smoke_leaves_exp_of_minus_k_d_of_the_contrast(extinction):
    camera, pose = Camera(hall()), Pose(15, 5, EAST)
    clear = camera.picture(pose).astype(float)
    smoky = camera.picture(pose, smoke=smoke(extinction)).astype(float)
    # Two places of the same wall, 5 m away: plaster above, the coloured band below.
    contrast = [p[80, 164].sum() - p[135, 164].sum() for p in (clear, smoky)]
    assert contrast[0] > 100
    assert contrast[1] / contrast[0] == pytest.approx(math.exp(-extinction * 5.0), abs=0.02)


def test_a_layer_under_the_ceiling_hides_the_ceiling_and_leaves_the_floor_clear():
    camera, pose = Camera(hall(3.0)), Pose(5, 5, EAST)
    clear = camera.picture(pose).astype(float)
    smoky = camera.picture(pose, smoke=smoke(2.0, share=0.4)).astype(float)
    assert np.array_equal(clear[120:], smoky[120:])  # below the lens, which is under the layer
    # The far wall, 15 m away: its upper 1.2 m are in the layer.
    face = 120 - (3.0 - 1.2 - 1.1) * FOCAL / 15
    column = np.abs(clear - smoky).max(axis=2)[:120, 150]
    assert np.flatnonzero(column > 4).max() == pytest.approx(face, abs=3)
    # Straight up into it: the ray to the ceiling 4 m ahead is in the layer for 1.2 of 1.9 m.
    row = round(120 - 1.9 * FOCAL / 4)
    length = 1.2 / 1.9 * math.hypot(4, 1.9)
    left = np.abs(smoky[row, 160] - [112, 110, 108]) / np.abs(clear[row, 160] - [112, 110, 108])
    assert left == pytest.approx(math.exp(-2.0 * length), abs=0.03)


def test_a_way_out_without_ground_beyond_it_is_a_shut_green_door():
    site = replace(hall(), exits=(Exit(20.0, 5.0, 0.0, 1.6, "East exit"),))
    picture = Camera(site).picture(Pose(16, 5, EAST)).astype(int)
    leaf = picture[150, 150]
    assert leaf[1] > leaf[0] + 20
    outside = picture[150, 160 + round(1.2 * FOCAL / 4)]
    assert abs(outside[1] - outside[0]) < 60
    assert not np.array_equal(leaf, outside)


def test_smoke_elsewhere_does_not_matter_and_near_smoke_hides_a_person():
    camera, pose = Camera(hall()), Pose(5, 5, EAST)
    values = np.zeros((20, 40))
    values[:, :4] = 5.0  # behind the lens
    there = Raster(values, (0.0, 20.0, 0.0, 10.0), "1/m")
    behind = camera.picture(pose, smoke=SmokeView(there, there))
    assert np.array_equal(behind, camera.picture(pose))
    person = [Figure("guard", 9, 5)]
    thick = [camera.picture(pose, who, smoke=smoke(3.0)) for who in ((), person)]
    assert len(changed(*thick)[0]) == 0


def test_water_shows_what_stands_behind_it_upside_down():
    camera, pose = Camera(hall()), Pose(14, 5, EAST)
    dry, wet = camera.picture(pose), camera.picture(pose, water=air(0.02))
    foot = 120 + 1.1 * FOCAL / 6
    assert np.array_equal(dry[: int(foot)], wet[: int(foot)])
    # The floor takes on some of the colour of the wall's band.
    row, mirrored = int(foot) + 20, int(foot) - 20
    before = np.abs(dry[row].astype(int) - dry[mirrored]).mean()
    after = np.abs(wet[row].astype(int) - dry[mirrored]).mean()
    assert after < 0.8 * before


def test_firelight_is_warm_and_stays_in_its_room():
    site = load_site("caparica")
    camera, pose = Camera(site), Pose(2, 12, EAST)
    room = site.room_at(5, 18)
    assert room != site.room_at(2, 12)
    hidden = camera.picture(pose, hazards=[burning(5, 18, 1.0)])
    assert len(changed(hidden, camera.picture(pose))[0]) < 400  # what a door lets through
    near = camera.picture(pose, hazards=[burning(7, 12, 0.5)]).astype(int)
    floor = (near - camera.picture(pose))[230, 100:220].mean(axis=0)
    assert floor[0] > 5 > floor[2]


def test_the_same_moment_gives_the_same_picture_and_flames_flicker():
    fire, pose = [burning(10, 5, 0.6)], Pose(5, 5, EAST)
    first, second = (Camera(hall()).picture(pose, hazards=fire, time=3.0) for _ in range(2))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, Camera(hall()).picture(pose, hazards=fire, time=3.2))


def test_a_lens_close_to_a_wall_or_outside_everything_still_gives_a_picture():
    camera = Camera(hall())
    for pose in (Pose(19.98, 5, EAST), Pose(0, 0, EAST), Pose(-50, -50, 1.0), Pose(300, 5, 0)):
        assert camera.picture(pose, [Figure("robot", 5, 5)], [burning(6, 5, 0.0)]).std() > 0
