"""Upright pictures of objects before a camera: people, robots, flames, gas bottles.

Each is drawn once per process. Which picture a hazard has, its own class says.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

SCALE = 120  # pixels per metre of a finished sprite
FINER = 4  # factor by which sprites are drawn larger, for smooth edges

CLOTHES = (
    ((166, 60, 58), (58, 62, 84)),
    ((70, 120, 92), (74, 66, 58)),
    ((222, 196, 120), (60, 74, 104)),
    ((96, 84, 150), (52, 52, 56)),
    ((214, 214, 210), (70, 84, 74)),
    ((86, 140, 176), (92, 84, 76)),
)
SKINS = ((236, 196, 166), (198, 146, 110), (128, 86, 62))
HAIRS = ((62, 44, 32), (30, 26, 26), (150, 110, 60), (120, 118, 116))
NAVY = (36, 48, 82)
VEST = (236, 206, 40)
SHELL = (228, 232, 236)
TRIM = (38, 110, 190)
DARK = (44, 48, 56)
FLAME_FRAMES = 6
VIEWS = ("front", "left", "back", "right")


class Sprite(NamedTuple):
    """A flat picture that always faces the lens.

    Attributes:
        colours: Red, green, blue `(3, rows, columns)`, the top row first, 0 to 255.
        cover: Opacity of each texel, `(rows, columns)`, 0 to 1.
        size: Width and height [m].
        glows: True if it needs no light.
    """

    colours: NDArray[np.float32]
    cover: NDArray[np.float32]
    size: tuple[float, float]
    glows: bool = False


def view_of(heading: float, bearing: float) -> str:
    """Return the side of a figure that a lens sees.

    Args:
        heading: Heading of the figure [rad].
        bearing: Bearing of the figure from the lens [rad].
    """
    return VIEWS[round((heading - bearing - math.pi) / (math.pi / 2)) % 4]


@cache
def person(view: str, number: int, guard: bool) -> Sprite:
    """Return a standing or walking person, 1.75 m tall.

    Args:
        view: `front`, `back`, `left` or `right`: the visible side of a person who faces
            the lens, turns the back on it, or looks to the left or right of the picture.
        number: Chooses clothes, skin and hair.
        guard: In uniform.
    """
    pen = _Pen(0.8, 1.8)
    skin = SKINS[number * 7 % len(SKINS)]
    hair = HAIRS[number * 5 % len(HAIRS)]
    top, legs = (NAVY, DARK) if guard else CLOTHES[number % len(CLOTHES)]
    side = view in ("left", "right")
    (_legs_apart if side else _legs)(pen, legs)
    (_trunk_from_the_side if side else _trunk)(pen, top, skin)
    if guard:
        half = 0.125 if side else 0.2
        pen.box(-half, 1.12, half, 1.19, VEST)
        pen.box(-half, 1.28, half, 1.33, VEST)
    _head(pen, view, skin, hair, NAVY if guard else None)
    return pen.sprite(mirrored=view == "right")


@cache
def lying(number: int, guard: bool) -> Sprite:
    """Return a person who lies on the floor."""
    up = person("right", number, guard)
    turned = np.ascontiguousarray(np.rot90(up.colours, axes=(1, 2)))
    return Sprite(turned, np.ascontiguousarray(np.rot90(up.cover)), (up.size[1], up.size[0] * 0.8))


@cache
def robot(view: str) -> Sprite:
    """Return a service robot: a round shell on wheels with a screen on a mast, 1.3 m tall."""
    pen = _Pen(0.8, 1.35)
    pen.ellipse(-0.26, 0.0, -0.12, 0.14, DARK)
    pen.ellipse(0.12, 0.0, 0.26, 0.14, DARK)
    pen.shape([(-0.3, 0.06), (0.3, 0.06), (0.3, 0.3), (0.22, 0.72), (-0.22, 0.72), (-0.3, 0.3)],
              SHELL)  # fmt: skip
    pen.shape([(0.1, 0.06), (0.3, 0.06), (0.3, 0.3), (0.22, 0.72), (0.1, 0.72)], (202, 207, 214))
    pen.box(-0.3, 0.24, 0.3, 0.31, TRIM)
    pen.box(-0.05, 0.7, 0.05, 1.0, DARK)
    if view == "front":
        pen.box(-0.22, 0.96, 0.22, 1.3, DARK)
        pen.box(-0.19, 0.99, 0.19, 1.27, (64, 150, 214))
        for middle in (-0.08, 0.08):
            pen.ellipse(middle - 0.035, 1.09, middle + 0.035, 1.19, (240, 250, 255))
        pen.ellipse(-0.06, 0.5, 0.06, 0.62, DARK)
    elif view == "back":
        pen.box(-0.22, 0.96, 0.22, 1.3, DARK)
        pen.box(-0.14, 0.42, 0.14, 0.46, DARK)
        pen.box(-0.14, 0.5, 0.14, 0.54, DARK)
        pen.ellipse(-0.06, 1.07, 0.06, 1.19, (206, 52, 44))
    else:
        pen.shape([(-0.1, 0.96), (0.06, 0.96), (0.06, 1.3), (-0.04, 1.3)], DARK)
        pen.shape([(-0.12, 0.98), (-0.09, 0.98), (-0.03, 1.28), (-0.06, 1.28)], (64, 150, 214))
    return pen.sprite(mirrored=view == "right")


@cache
def bottle() -> Sprite:
    """Return a leaking gas bottle and its cloud."""
    pen = _Pen(1.0, 1.6)
    for number in range(9):
        x = 0.05 + 0.042 * number
        y = 1.14 + 0.035 * number
        pen.ellipse(x - 0.05 - 0.012 * number, y - 0.05, x + 0.05 + 0.012 * number, y + 0.06,
                    (236, 240, 236, 150 - 13 * number))  # fmt: skip
    pen.box(-0.16, 0.0, 0.16, 0.95, (222, 172, 26))
    pen.ellipse(-0.16, 0.85, 0.16, 1.06, (222, 172, 26))
    pen.box(0.06, 0.0, 0.16, 0.95, (190, 144, 22))
    pen.box(-0.05, 1.02, 0.05, 1.14, DARK)
    pen.shape([(0, 0.32), (0.13, 0.5), (0, 0.68), (-0.13, 0.5)], (206, 52, 44))
    pen.shape([(0, 0.37), (0.09, 0.5), (0, 0.63), (-0.09, 0.5)], (250, 250, 246))
    pen.box(-0.015, 0.46, 0.015, 0.58, DARK)
    return pen.sprite()


@cache
def flames(frame: int) -> Sprite:
    """Return tongues of fire in a box of one metre by one; scaled to the fire they belong to."""
    rows = 120
    columns = 96
    y = 1.0 - (np.arange(rows)[:, None] + 0.5) / rows
    x = (np.arange(columns)[None, :] + 0.5) / columns * 2 - 1
    turn = 2 * math.pi * frame / FLAME_FRAMES
    sway = 0.09 * np.sin(5.0 * y + turn) * y + 0.05 * np.sin(11.0 * y - 2 * turn) * y
    across = x + sway
    tongues = (
        0.62
        + 0.20 * np.cos(7.3 * across + 1.3 + 0.8 * math.sin(turn))
        + 0.13 * np.cos(13.1 * across + 2.0 * math.cos(turn))
        + 0.07 * np.cos(29.0 * across - turn)
    )
    height = tongues * np.sqrt(np.clip(1.0 - across**2, 0.0, 1.0))
    heat = np.clip(1.25 * (1.0 - y / np.maximum(height, 1e-3)), 0.0, 1.0)
    red = np.clip(150 + 360 * heat, 0, 255)
    green = np.clip(30 + 260 * heat**1.3, 0, 250)
    blue = np.clip(10 + 260 * (heat - 0.55) * (heat > 0.55), 0, 210)
    cover = np.clip(heat * 3.5, 0.0, 0.96)
    return Sprite(
        np.stack([red, green, blue]).astype(np.float32), cover.astype(np.float32), (1.0, 1.0), True
    )


def _legs(pen: _Pen, colour: Any) -> None:
    for side in (-1, 1):
        pen.shape(
            [(side * 0.02, 0.05), (side * 0.13, 0.05), (side * 0.17, 0.86), (0, 0.86)], colour
        )
        pen.ellipse(side * 0.085 - 0.07, 0.0, side * 0.085 + 0.07, 0.1, DARK)


def _legs_apart(pen: _Pen, colour: Any) -> None:
    pen.shape([(0.14, 0.06), (0.25, 0.1), (0.1, 0.88), (-0.04, 0.86)], _darker(colour))
    pen.shape([(-0.22, 0.05), (-0.11, 0.05), (0.1, 0.86), (-0.1, 0.88)], colour)
    pen.ellipse(-0.31, 0.0, -0.1, 0.1, DARK)
    pen.ellipse(0.08, 0.02, 0.28, 0.12, DARK)


def _trunk(pen: _Pen, colour: Any, skin: Any) -> None:
    for side in (-1, 1):
        pen.shape([(side * 0.18, 1.42), (side * 0.24, 1.36), (side * 0.29, 0.84),
                   (side * 0.22, 0.84), (side * 0.17, 1.2)], _darker(colour))  # fmt: skip
        pen.ellipse(side * 0.255 - 0.045, 0.76, side * 0.255 + 0.045, 0.87, skin)
    pen.box(-0.05, 1.4, 0.05, 1.52, skin)
    pen.shape([(-0.19, 0.82), (0.19, 0.82), (0.21, 1.38), (0.1, 1.46), (-0.1, 1.46), (-0.21, 1.38)],
              colour)  # fmt: skip


def _trunk_from_the_side(pen: _Pen, colour: Any, skin: Any) -> None:
    pen.box(-0.05, 1.4, 0.04, 1.52, skin)
    pen.shape([(-0.12, 0.82), (0.11, 0.82), (0.12, 1.36), (0.03, 1.46), (-0.09, 1.45),
               (-0.13, 1.3)], colour)  # fmt: skip
    pen.shape([(-0.04, 1.38), (0.06, 1.38), (0.03, 1.1), (-0.16, 0.88), (-0.22, 0.94),
               (-0.07, 1.14)], _darker(colour))  # fmt: skip
    pen.ellipse(-0.25, 0.84, -0.15, 0.95, skin)


def _head(pen: _Pen, view: str, skin: Any, hair: Any, cap: Any) -> None:
    pen.ellipse(-0.105, 1.47, 0.105, 1.75, hair)
    if view == "front":
        pen.ellipse(-0.095, 1.47, 0.095, 1.69, skin)
        for side in (-0.04, 0.04):
            pen.ellipse(side - 0.014, 1.58, side + 0.014, 1.615, DARK)
        pen.box(-0.03, 1.515, 0.03, 1.53, _darker(skin))
    elif view != "back":
        pen.ellipse(-0.11, 1.48, 0.05, 1.69, skin)
        pen.ellipse(-0.13, 1.56, -0.08, 1.61, skin)
        pen.ellipse(-0.085, 1.585, -0.06, 1.615, DARK)
    if cap is not None:
        pen.ellipse(-0.12, 1.62, 0.12, 1.79, cap)
        if view in ("left", "right"):
            pen.box(-0.19, 1.65, 0.0, 1.685, DARK)
        elif view == "front":
            pen.ellipse(-0.12, 1.635, 0.12, 1.69, DARK)


def _darker(colour: Any) -> tuple[int, ...]:
    return tuple(int(0.78 * part) for part in colour[:3])


class _Pen:
    """Draws in metres, x from the middle, y from the floor.

    Args:
        width: [m]
        height: [m]
    """

    def __init__(self, width: float, height: float) -> None:
        self._size = (width, height)
        self._scale = SCALE * FINER
        pixels = round(width * self._scale), round(height * self._scale)
        self._image = Image.new("RGBA", pixels)
        self._draw = ImageDraw.Draw(self._image, "RGBA")

    def _at(self, x: float, y: float) -> tuple[float, float]:
        return (x + self._size[0] / 2) * self._scale, (self._size[1] - y) * self._scale

    def box(self, x1: float, y1: float, x2: float, y2: float, colour: Any) -> None:
        """Draw a rectangle from its lower left to its upper right corner."""
        self._draw.rectangle((*self._at(x1, y2), *self._at(x2, y1)), fill=colour)

    def ellipse(self, x1: float, y1: float, x2: float, y2: float, colour: Any) -> None:
        """Draw an ellipse in such a rectangle."""
        self._draw.ellipse((*self._at(x1, y2), *self._at(x2, y1)), fill=colour)

    def shape(self, corners: Any, colour: Any) -> None:
        """Draw a polygon."""
        self._draw.polygon([self._at(x, y) for x, y in corners], fill=colour)

    def sprite(self, mirrored: bool = False) -> Sprite:
        """Return the drawing with smooth edges."""
        image = self._image.transpose(Image.Transpose.FLIP_LEFT_RIGHT) if mirrored else self._image
        values = np.asarray(image, dtype=np.float32)
        rows = values.shape[0] // FINER
        columns = values.shape[1] // FINER
        blocks = values.reshape(rows, FINER, columns, FINER, 4)
        cover = blocks[..., 3].mean(axis=(1, 3)) / 255
        weighted = (blocks[..., :3] * blocks[..., 3:]).mean(axis=(1, 3)) / 255
        colours = weighted / np.maximum(cover, 1e-3)[..., None]
        return Sprite(np.ascontiguousarray(np.moveaxis(colours, -1, 0)), cover, self._size)


class Figure(NamedTuple):
    """A person or an object that moves, as a camera may see it.

    Attributes:
        kind: `robot`, `guard` or `bystander`.
        x: East [m].
        y: North [m].
        heading: Heading [rad].
        number: Number that selects a person's looks.
        lying: True for a person lying on the floor.
    """

    kind: str
    x: float
    y: float
    heading: float = 0.0
    number: int = 1
    lying: bool = False


def choose_sprite(figure: Figure, bearing: float) -> Sprite:
    """Return the sprite of a figure as seen from the lens.

    Args:
        bearing: Bearing of the figure from the lens [rad].
    """
    view = view_of(figure.heading, bearing)
    if figure.kind == "robot":
        return robot(view)
    guard = figure.kind == "guard"
    if figure.lying:
        return lying(figure.number, guard)
    return person(view, figure.number, guard)
