import functools
import math

import numpy as np
import pytest
import shapely
from matplotlib.figure import Figure
from PIL import Image

from dva_sim.worlds.site import load_site, map_site
from dva_sim.worlds.site_parts import FixedCamera
from dva_sim.worlds.view import COVERAGE, EXIT, WALL, draw_site, poster
from dva_sim.worlds.view_marks import view_of


def write_hall(folder):
    """A bare map: a free hall of 6 m by 4 m in unknown ground."""
    pixels = np.full((60, 80), 205, np.uint8)
    pixels[10:50, 10:70] = 254
    Image.fromarray(pixels).save(folder / "hall.pgm")
    (folder / "hall.yaml").write_text(
        "image: hall.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return map_site(folder / "hall.yaml", 1, 1, 1)


def colour_at(figure, ax, x, y):
    """Red, green and blue of the picture at a place of the site."""
    figure.canvas.draw()
    column, row = ax.transData.transform((x, y))
    picture = np.asarray(figure.canvas.buffer_rgba())
    return tuple(int(c) for c in picture[picture.shape[0] - 1 - int(row), int(column), :3])


def draw(site, **options):
    figure = Figure(figsize=(8, 5), dpi=100)
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    ax = figure.add_subplot()
    draw_site(ax, site, **options)
    return figure, ax


def test_walls_are_dark_and_doors_are_gaps():
    figure, ax = draw(load_site("caparica"), labels=False)
    wall = tuple(int(WALL[i : i + 2], 16) for i in (1, 3, 5))
    assert colour_at(figure, ax, 9.0, 10.8) == wall
    assert min(colour_at(figure, ax, 12.0, 10.8)) > 200


def names_of(ax):
    return {text.get_text().replace("\n", " ") for text in ax.texts}


def test_every_room_has_its_name_when_labels_are_wanted():
    site = load_site("caparica")
    _, ax = draw(site)
    assert {room.name for room in site.rooms} | {"10 m", "N"} == names_of(ax)
    _, bare = draw(site, labels=False)
    assert [text.get_text() for text in bare.texts] == ["10 m"]


@pytest.mark.system
@pytest.mark.parametrize("width", [60, pytest.param(120, marks=pytest.mark.soak)])
def test_no_name_leaves_its_room_however_small_it_is_drawn(width):
    site = load_site("office-block", {"width_m": width, "depth_m": 30})
    figure, ax = draw(site)
    figure.canvas.draw()
    written = 0
    for text in ax.texts:
        box = text.get_window_extent().transformed(ax.transData.inverted())
        room = site.room_at(*text.get_position())
        if room is None:
            continue  # the scale bar and the arrow to the north
        corners = site.room(room).polygon
        assert (corners.min(axis=0) < box.min).all()
        assert (box.max < corners.max(axis=0)).all()
        assert text.get_text().split("\n")[-1].split()[-1] in room
        written += 1
    assert written > 0.9 * len(site.rooms)


def test_exits_are_green_and_lie_in_the_wall():
    site = load_site("office-block")
    figure, ax = draw(site, labels=False)
    way = site.exits[0]
    green = tuple(int(EXIT[i : i + 2], 16) for i in (1, 3, 5))
    assert colour_at(figure, ax, way.x, way.y) == pytest.approx(green, abs=12)


def test_a_camera_sees_up_to_its_range_and_not_through_walls():
    site = load_site("caparica")
    camera = FixedCamera(0.5, 12.0, 0.0, math.radians(90), 15.0, "corridor")
    view = view_of(site, camera)
    seen = shapely.Polygon(view)
    assert seen.contains(shapely.Point(15.0, 12.0))
    assert not seen.contains(shapely.Point(16.0, 12.0))
    assert not seen.contains(shapely.Point(3.0, 14.0))
    assert np.hypot(*(view - (0.5, 12.0)).T).max() == pytest.approx(15.0)


def test_a_bare_map_shows_its_known_free_floor(tmp_path):
    figure, ax = draw(write_hall(tmp_path))
    inside, outside = colour_at(figure, ax, 3.05, 3.05), colour_at(figure, ax, 0.5, 3.05)
    assert inside != outside == (255, 255, 255)
    assert ax.get_xlim() == pytest.approx((1.0 - 0.8, 7.0 + 0.8))


@pytest.mark.system
def test_names_too_small_to_read_are_left_out_if_that_is_wanted():
    site = load_site("campus")
    _, ax = draw(site, least=6.0)
    sizes = [text.get_fontsize() for text in ax.texts if site.room_at(*text.get_position())]
    assert min(sizes) >= 6.0
    assert len(sizes) < len(names_of(draw(site)[1]))


def test_a_map_without_small_marks_still_has_its_bases_and_desks():
    site = load_site("caparica")
    full, few = draw(site)[1], draw(site, small_marks=False)[1]
    assert len(few.lines) < len(full.lines)
    assert len(few.patches) == len(full.patches)


@functools.cache
def drawn(name, coverage):
    return poster(load_site(name), coverage)


@pytest.mark.parametrize(("name", "coverage"), [("caparica", False), ("campus", True)])
def test_a_poster_has_a_key_that_fits_below_its_map_and_can_be_read_on_a_page(name, coverage):
    figure = drawn(name, coverage)
    figure.draw_without_rendering()
    (key,) = figure.legends
    box = key.get_window_extent()
    assert box.x0 >= 0
    assert box.x1 <= figure.bbox.width
    assert box.y1 <= figure.axes[0].bbox.y0 + 2
    page = 840 / figure.get_figwidth() / 72  # pixels of a point
    assert min(text.get_fontsize() for text in key.get_texts()) * page > 8


def test_a_poster_of_coverage_has_no_other_wash_of_colour():
    views, waves = drawn("caparica", False).axes[0], drawn("campus", True).axes[0]
    assert washes(views) == len(load_site("caparica").cameras)
    covered = [area for area in load_site("campus").wifi if area.grade in COVERAGE]
    assert washes(waves) == len(covered)


def washes(ax):
    return sum(1.5 < patch.get_zorder() < 2 for patch in ax.patches)
