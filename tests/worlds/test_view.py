import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from dva_sim.worlds.site import load_site, map_site
from dva_sim.worlds.view import WALL, draw_site


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


def test_every_room_has_its_name_when_labels_are_wanted():
    site = load_site("caparica")
    _, ax = draw(site)
    assert {room.name for room in site.rooms} <= {text.get_text() for text in ax.texts}
    _, bare = draw(site, labels=False)
    assert [text.get_text() for text in bare.texts] == ["10 m"]


def test_a_bare_map_shows_its_known_free_floor(tmp_path):
    figure, ax = draw(write_hall(tmp_path))
    inside, outside = colour_at(figure, ax, 3.05, 3.05), colour_at(figure, ax, 0.5, 3.05)
    assert inside != outside == (255, 255, 255)
    assert ax.get_xlim() == pytest.approx((1.0 - 0.8, 7.0 + 0.8))
