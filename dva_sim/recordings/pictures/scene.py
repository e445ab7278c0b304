"""Names beside bodies: they keep clear of each other, of bodies and of room names.

One run on one map: the site, its hazards, everybody on it, what is told, and how it ended.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.patheffects import withStroke
from matplotlib.spines import Spine

from dva_sim.kernel.recorder import Moment
from dva_sim.recordings.pictures import style
from dva_sim.recordings.pictures.colours import BYSTANDER, GUARD, ROBOT
from dva_sim.recordings.pictures.layers import LAYER, DrawnBody, DrawnFields
from dva_sim.recordings.pictures.moments import Moments
from dva_sim.recordings.pictures.run_endings import RunVerdict
from dva_sim.worlds.view import draw_site
from dva_sim.worlds.view_marks import points_per_metre

# Where a name may stand about a body: above, below, right, left, and the corners.
SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1))
MOVING_COST = 6.0  # a name stays on its side rather than jump for less [pixels of overlap]
SOURCE = 11.0  # diameter of the mark of a hazard [points]
OUTSIDE_COST = 50.0  # of a pixel beyond the border of the map


class Box(NamedTuple):
    """A rectangle [pixels]."""

    x0: float
    y0: float
    x1: float
    y1: float

    def overlap(self, other: Box) -> float:
        """Square root of the area that two share [pixels]."""
        wide = min(self.x1, other.x1) - max(self.x0, other.x0)
        high = min(self.y1, other.y1) - max(self.y0, other.y0)
        return float((wide * high) ** 0.5) if wide > 0 and high > 0 else 0.0

    def beyond(self, frame: Box) -> float:
        """How far it reaches out of a frame [pixels]."""
        gaps = (frame.x0 - self.x0, frame.y0 - self.y0, self.x1 - frame.x1, self.y1 - frame.y1)
        return sum(max(0.0, gap) for gap in gaps)


class Names:
    """The names on one map; bystanders have none, there are too many.

    Args:
        ax: Where, with the names of rooms already written.
        bodies: Whose names.
    """

    def __init__(self, ax: Axes, bodies: Sequence[DrawnBody]) -> None:
        self._ax, self._bodies = ax, bodies
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
        """The names at a moment [s]; the sources of hazards stay clear, too [m]."""
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
        """What something of a size [points] covers."""
        x, y = self._ax.transData.transform(place)
        half = size / 2 * self._ax.figure.dpi / 72
        return Box(x - half, y - half, x + half, y + half)

    def _put(
        self, body: DrawnBody, text: Any, time: float, renderer: Any, frame: Box, taken: list[Box]
    ) -> Box:
        """Write a name where it is least in the way."""
        extent = text.get_window_extent(renderer)
        mark, size = self._box_of(body.place(time), body.size()), (extent.width, extent.height)
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
    """A box of a size on one side of another."""
    x, y = (mark.x0 + mark.x1) / 2, (mark.y0 + mark.y1) / 2
    half = (mark.x1 - mark.x0) / 2 + 1.5
    # At a corner it comes nearer, for a body is round.
    near = 0.75 if side[0] and side[1] else 1.0
    x += side[0] * (near * half + size[0] / 2)
    y += side[1] * (near * half + size[1] / 2)
    return Box(x - size[0] / 2, y - size[1] / 2, x + size[0] / 2, y + size[1] / 2)


PLAIN, BOLD = 0.6, 0.68  # how wide a letter is on the average, at most [font sizes]


class Scene:
    """A map that can show any moment of a run; a run that has ended stays as it was at its end.

    Args:
        ax: Where; it has its size already.
        moments: The run.
        verdict: How it ended, told below the map from then on.
        title: Above the map on the left.
        outlook: Told below the map until then; None for the newest line of the story.
    """

    def __init__(
        self,
        ax: Axes,
        moments: Moments,
        verdict: RunVerdict,
        title: str = "",
        outlook: str | None = None,
    ) -> None:
        self._ax, self._moments, self._verdict, self._outlook = ax, moments, verdict, outlook
        limits = self._draw_ground()
        names = moments.names(BYSTANDER, GUARD, ROBOT)
        self._fields = DrawnFields(ax, moments)
        self._bodies = [DrawnBody(ax, moments, name) for name in names]
        self._names = Names(ax, self._bodies)
        ax.set(xlim=limits[0], ylim=limits[1], aspect="equal")
        self._clock = ax.set_title("", loc="right", fontsize=style.TITLE, pad=2)
        self._clock.set_animated(True)
        ax.set_title(title, fontsize=style.TITLE, fontweight="bold", loc="left", pad=2)
        self._told, self._ended = self._line(), self._line(_colour_of(verdict))
        self._ended.set(text=verdict.told, fontsize=style.FONT + 0.5)
        if len(verdict.told) * BOLD * style.TITLE < self._across():
            self._ended.set_fontsize(style.TITLE)

    def _draw_ground(self) -> tuple[Any, Any]:
        """The site; the limits of what is seen."""
        ax, site = self._ax, self._moments.recording.site
        draw_site(ax, site, small_marks=points_per_metre(ax) > style.ROOMY, least=style.LEAST)
        # What hazards must not cover is drawn after them.
        self._upper: list[Any] = [artist for artist in ax.get_children() if _stands_out(artist)]
        for artist in self._upper:
            artist.set_animated(True)
        return ax.get_xlim(), ax.get_ylim()

    def _line(self, colour: str | None = None) -> Any:
        """A line of text below the map; in a box of a colour."""
        box = {"boxstyle": "round,pad=0.25", "fc": colour, "ec": "none"} if colour else None
        return self._ax.annotate(
            " ", (0.5, 0.0), xycoords="axes fraction", xytext=(0, -4), textcoords="offset points",
            ha="center", va="top", animated=True, bbox=box,
            fontsize=style.TITLE if colour else style.FONT + 0.5,
            fontweight="bold" if colour else "normal", color="white" if colour else style.INK,
        )  # fmt: skip

    def show(self, time: float) -> list[Artist]:
        """Artists that change, as they are at a moment [s], the lowest first."""
        now = self._moments.within(time)
        artists = [*self._fields.show(now), *self._upper]
        for body in self._bodies:
            artists += body.show(now)
        sources = [incident.hazard.position for incident in self._moments.going_on(now)]
        artists += self._names.show(now, sources)
        artists.sort(key=lambda artist: artist.get_zorder())
        self._clock.set_text(f"{now:.1f} s")
        return [*artists, self._clock, self._below(now)]

    def _below(self, time: float) -> Artist:
        """The line below the map: what happened last, or how it ended."""
        ended: Artist = self._ended
        if self._verdict.text and time >= self._verdict.time:
            return ended
        timeline = self._moments.recording.recorder.timeline
        told = _told(timeline, time) if self._outlook is None else self._outlook
        self._told.set_text(_shortened(told, int(self._across() / (PLAIN * style.FONT))))
        line: Artist = self._told
        return line

    def _across(self) -> float:
        """Width of the map [points]."""
        figure: Any = self._ax.figure
        return float(self._ax.bbox.width * 72 / figure.dpi)

    def freeze(self, canvas: Any) -> None:
        """From now on draw what stands still as one sheet: the layout is final."""
        renderer = type(canvas.get_renderer())(*canvas.get_width_height(), canvas.figure.dpi)
        for artist in sorted(self._upper, key=lambda artist: artist.get_zorder()):
            artist.draw(renderer)
        self._upper = [_Sheet(renderer)]

    def fix(self, time: float) -> None:
        """Show a moment [s] for good."""
        shown = {id(artist) for artist in self.show(time)}
        children: list[Any] = [*self._ax.get_children(), self._clock]
        for artist in children:
            if artist.get_animated():
                artist.set(animated=False, visible=id(artist) in shown)


class _Sheet:
    """A finished layer, as an artist; lies between hazards and bodies."""

    def __init__(self, renderer: Any) -> None:
        self._pixels = np.asarray(renderer.buffer_rgba())[::-1].copy()  # from the lowest row up

    def get_zorder(self) -> float:
        """Over walls and names, under lines of equal heat or gas."""
        return 4.2

    def draw(self, renderer: Any) -> None:
        """Lay it over what is there."""
        renderer.draw_image(renderer.new_gc(), 0, 0, self._pixels)


def _stands_out(artist: Artist) -> bool:
    """Whether a part of the site lies above hazards: walls, doors, names."""
    return artist.get_zorder() > LAYER and not isinstance(artist, Axis | Spine)


def _colour_of(verdict: RunVerdict) -> str:
    """Of the box in which a run's end is told."""
    if not verdict.good:
        return style.FAILED
    return style.BEHIND if verdict.ahead < 0 else style.AHEAD


def _told(timeline: Sequence[Moment], time: float) -> str:
    """The newest line of the story."""
    told = [m for m in timeline if m.time <= time and m.kind != "link"]
    return f"{told[-1].who} {told[-1].what}".replace("_", " ") if told else ""


def _shortened(text: str, most: int) -> str:
    """The text, or as many letters of it as there is room for."""
    return text if len(text) <= most else f"{text[: most - 1].rstrip()}…"
