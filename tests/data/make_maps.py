"""The maps here look like what a robot records; they are drawn and spoilt by this script.

    python tests/data/make_maps.py

`hall` is a building with offices along a passage, a slanted wall and pillars, `racks` a storehouse
with rows of shelves. As on a recorded map walls are ragged and beyond them nothing is known.
"""

import itertools
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

HERE = Path(__file__).parent
FREE, OCCUPIED, UNKNOWN = 254, 0, 205
HALL_M, RACKS_M = 0.05, 0.03  # a cell [m]


def hall() -> Image.Image:
    """24 m x 14 m."""
    image, draw, wall = _building(24, 14, HALL_M)
    for x in (8, 16):  # offices on both sides of a passage
        for y0, y1 in ((1, 5), (9, 13)):
            wall((x, y0), (x, y1))
    for y in (5, 9):
        for x0, x1 in ((1, 3), (4.2, 11), (12.2, 19), (20.2, 23)):  # with doors between
            wall((x0, y), (x1, y))
    wall((17.5, 13), (20.5, 9))
    for x in (6, 12, 18):
        draw(x, 7, 0.25)
    return image


def racks() -> Image.Image:
    """24 m x 12 m."""
    image, draw, wall = _building(24, 12, RACKS_M)
    for y in (3, 5, 7, 9):
        for x in (3, 10, 17):
            wall((x, y), (x + 5, y), 0.6)
    for x in (9, 16):
        draw(x, 10.5, 0.3)
    return image


def _building(width, height, cell):
    """An empty one, and what draws pillars and walls into it, in metres."""
    size = round(width / cell), round(height / cell)
    image = Image.new("L", size, UNKNOWN)
    pen = ImageDraw.Draw(image)
    pen.rectangle([1 / cell, 1 / cell, (width - 1) / cell, (height - 1) / cell], FREE)

    def pillar(x, y, radius):
        ends = (x - radius, height - y - radius, x + radius, height - y + radius)
        pen.ellipse([end / cell for end in ends], OCCUPIED)

    def wall(start, end, thick=0.15):
        points = [(x / cell, (height - y) / cell) for x, y in (start, end)]
        pen.line(points, OCCUPIED, round(thick / cell))

    corners = [(1, 1), (width - 1, 1), (width - 1, height - 1), (1, height - 1), (1, 1)]
    for start, end in itertools.pairwise(corners):
        wall(start, end)
    return image, pillar, wall


def ragged(image: Image.Image) -> NDArray[np.uint8]:
    """Here and there a cell beside a wall is occupied too, and one of the floor is not known."""
    rng, cells = np.random.default_rng(1), np.asarray(image).copy()
    wall = np.pad(cells == OCCUPIED, 1)
    beside = wall[:-2, 1:-1] | wall[2:, 1:-1] | wall[1:-1, :-2] | wall[1:-1, 2:]
    cells[beside & (rng.random(cells.shape) < 0.15)] = OCCUPIED
    cells[(cells == FREE) & (rng.random(cells.shape) < 0.0005)] = UNKNOWN
    return cells


def main() -> None:
    for draw, cell in ((hall, HALL_M), (racks, RACKS_M)):
        name = draw.__name__
        Image.fromarray(ragged(draw())).save(HERE / f"{name}.png", optimize=True)
        (HERE / f"{name}.yaml").write_text(
            f"image: {name}.png\nmode: trinary\nresolution: {cell}\norigin: [-2.0, -3.0, 0]\n"
            "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
        )


if __name__ == "__main__":
    main()
