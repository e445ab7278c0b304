"""Names beside bodies: they keep clear of each other, of bodies and of room names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from dva_sim.recordings.pictures import style
from dva_sim.recordings.pictures.bodies import DrawnBody
from dva_sim.recordings.pictures.colours import BYSTANDER

# Where a name may stand about a body: above, below, right, left, and the corners.
SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1))


MOVING_COST = 6.0  # overlap above which a name changes sides [pixels]


SOURCE = 11.0  # diameter of the mark of a hazard [points]


OUTSIDE_COST = 50.0  # cost of a pixel beyond the border of the map


class Box(NamedTuple):
    """A rectangle [pixels]."""

    x0: float
    y0: float
    x1: float
    y1: float

    def overlap(self, other: Box) -> float:
        """Return the square root of the area that two share [pixels]."""
        wide = min(self.x1, other.x1) - max(self.x0, other.x0)
        high = min(self.y1, other.y1) - max(self.y0, other.y0)
        return float((wide * high) ** 0.5) if wide > 0 and high > 0 else 0.0

    def beyond(self, frame: Box) -> float:
        """Return how far the box exceeds a frame [pixels]."""
        gaps = (frame.x0 - self.x0, frame.y0 - self.y0, self.x1 - frame.x1, self.y1 - frame.y1)
        return sum(max(0.0, gap) for gap in gaps)


class Names:
    """The names on one map; bystanders have none, there are too many.

    Args:
        ax: Axes, with the names of rooms already written.
        bodies: Bodies to label.
    """

    def __init__(self, ax: Axes, bodies: Sequence[DrawnBody]) -> None:
        self._ax = ax
        self._bodies = bodies
        self._fixed = [text for text in ax.texts if text.get_text()]
        halo = [withStroke(linewidth=2.2, foreground=style.HALO)]
        self._texts = {
            body.name: ax.text(
                0, 0, body.name, fontsize=style.FONT, color=style.INK, ha="center", va="center",
                path_effects=halo, zorder=8, animated=True,
            )
            for body in bodies
            if body.kind != BYSTANDER
        }  # fmt: skip
        self._side: dict[str, int] = {}
        self._rooms: list[Box] = []  # known once the figure has its layout

    def show(self, time: float, sources: Sequence[tuple[float, float]]) -> list[Artist]:
        """Return the names at a moment [s]; the sources of hazards stay clear, too [m]."""
        canvas: Any = self._ax.figure.canvas
        renderer = canvas.get_renderer()
        frame = Box(*self._ax.get_window_extent(renderer).extents)
        if not self._rooms:
            extents = [text.get_window_extent(renderer).extents for text in self._fixed]
            self._rooms = [Box(*extent) for extent in extents]
        taken = list(self._rooms)
        bodies = [body for body in self._bodies if body.is_there(time)]
        taken += [self._box_of(body.place(time), body.size()) for body in bodies]
        taken += [self._box_of(place, SOURCE) for place in sources]
        named = [body for body in bodies if body.name in self._texts]
        for body in named:
            taken.append(self._put(body, self._texts[body.name], time, renderer, frame, taken))
        return [self._texts[body.name] for body in named]

    def _box_of(self, place: tuple[float, float], size: float) -> Box:
        """Return the box of something with a size [points]."""
        x, y = self._ax.transData.transform(place)
        half = size / 2 * self._ax.figure.dpi / 72
        return Box(x - half, y - half, x + half, y + half)

    def _put(
        self, body: DrawnBody, text: Any, time: float, renderer: Any, frame: Box, taken: list[Box]
    ) -> Box:
        """Write a name where it is least in the way."""
        extent = text.get_window_extent(renderer)
        mark = self._box_of(body.place(time), body.size())
        size = (extent.width, extent.height)
        boxes = [_beside(mark, size, side) for side in SIDES]
        kept = self._side.get(body.name, 0)
        costs = [
            sum(box.overlap(other) for other in taken)
            + OUTSIDE_COST * box.beyond(frame)
            + (MOVING_COST if number != kept else 0.0)
            for number, box in enumerate(boxes)
        ]
        best = min(range(len(boxes)), key=lambda number: costs[number])
        self._side[body.name] = best
        box = boxes[best]
        middle = (box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2
        text.set_position(self._ax.transData.inverted().transform(middle))
        return box


def _beside(mark: Box, size: tuple[float, float], side: tuple[int, int]) -> Box:
    """Return a box of a size on one side of another."""
    x = (mark.x0 + mark.x1) / 2
    y = (mark.y0 + mark.y1) / 2
    half = (mark.x1 - mark.x0) / 2 + 1.5
    # At a corner it comes nearer, for a body is round.
    near = 0.75 if side[0] and side[1] else 1.0
    x += side[0] * (near * half + size[0] / 2)
    y += side[1] * (near * half + size[1] / 2)
    return Box(x - size[0] / 2, y - size[1] / 2, x + size[0] / 2, y + size[1] / 2)
