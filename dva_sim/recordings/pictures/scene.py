"""The picture of a run: its map with hazards, robots and people, the story and the outcome."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.spines import Spine

from dva_sim.kernel.recorder import Moment
from dva_sim.recordings.pictures import style
from dva_sim.recordings.pictures.bodies import DrawnBody
from dva_sim.recordings.pictures.colours import BYSTANDER, GUARD, ROBOT
from dva_sim.recordings.pictures.fields import LAYER, DrawnFields
from dva_sim.recordings.pictures.moments import Moments
from dva_sim.recordings.pictures.name_labels import Names
from dva_sim.recordings.pictures.run_endings import RunVerdict
from dva_sim.worlds.view import draw_site
from dva_sim.worlds.view_marks import points_per_metre

PLAIN = 0.6  # upper bound of the mean width of a letter [font sizes]
BOLD = 0.68  # upper bound of the mean width of a bold letter [font sizes]


class Scene:
    """A map that can show any moment of a run; after its end, the last moment.

    Args:
        ax: Axes to draw on, with their final size.
        moments: The run.
        verdict: Outcome, shown below the map from then on.
        title: Above the map on the left.
        outlook: Text below the map until then; None for the newest line of the story.
    """

    def __init__(
        self,
        ax: Axes,
        moments: Moments,
        verdict: RunVerdict,
        title: str = "",
        outlook: str | None = None,
    ) -> None:
        self._ax = ax
        self._moments = moments
        self._verdict = verdict
        self._outlook = outlook
        limits = self._draw_ground()
        names = moments.names(BYSTANDER, GUARD, ROBOT)
        self._fields = DrawnFields(ax, moments)
        self._bodies = [DrawnBody(ax, moments, name) for name in names]
        self._names = Names(ax, self._bodies)
        ax.set(xlim=limits[0], ylim=limits[1], aspect="equal")
        self._clock = ax.set_title("", loc="right", fontsize=style.TITLE, pad=2)
        self._clock.set_animated(True)
        ax.set_title(title, fontsize=style.TITLE, fontweight="bold", loc="left", pad=2)
        self._story_line = self._line()
        self._ended = self._line(_colour_of(verdict))
        self._ended.set(text=verdict.full_text, fontsize=style.FONT + 0.5)
        if len(verdict.full_text) * BOLD * style.TITLE < self._across():
            self._ended.set_fontsize(style.TITLE)

    def _draw_ground(self) -> tuple[Any, Any]:
        """Draw the site; return the limits of the map."""
        ax = self._ax
        site = self._moments.recording.site
        draw_site(
            ax, site, small_marks=points_per_metre(ax) > style.ROOMY, least=style.MIN_NAME_POINTS
        )
        # What hazards must not cover is drawn after them.
        self._upper: list[Any] = [
            artist
            for artist in ax.get_children()
            if artist.get_zorder() > LAYER and not isinstance(artist, Axis | Spine)
        ]
        for artist in self._upper:
            artist.set_animated(True)
        return ax.get_xlim(), ax.get_ylim()

    def _line(self, colour: str | None = None) -> Any:
        """Return a line of text below the map; in a box of a colour."""
        box = {"boxstyle": "round,pad=0.25", "fc": colour, "ec": "none"} if colour else None
        return self._ax.annotate(
            " ", (0.5, 0.0), xycoords="axes fraction", xytext=(0, -4), textcoords="offset points",
            ha="center", va="top", animated=True, bbox=box,
            fontsize=style.TITLE if colour else style.FONT + 0.5,
            fontweight="bold" if colour else "normal", color="white" if colour else style.INK,
        )  # fmt: skip

    def show(self, time: float) -> list[Artist]:
        """Return the artists that change, updated to a moment [s], the lowest first."""
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
        """Return the line below the map: the last fact, or the outcome."""
        ended: Artist = self._ended
        if self._verdict.text and time >= self._verdict.time:
            return ended
        timeline = self._moments.recording.recorder.timeline
        text = _newest_line(timeline, time) if self._outlook is None else self._outlook
        most = int(self._across() / (PLAIN * style.FONT))
        self._story_line.set_text(text if len(text) <= most else f"{text[: most - 1].rstrip()}…")
        line: Artist = self._story_line
        return line

    def _across(self) -> float:
        """Return the width of the map [points]."""
        figure: Any = self._ax.figure
        return float(self._ax.bbox.width * 72 / figure.dpi)

    def freeze(self, canvas: Any) -> None:
        """Draw all fixed artists as one image from now on: the layout is final."""
        renderer = type(canvas.get_renderer())(*canvas.get_width_height(), canvas.figure.dpi)
        for artist in sorted(self._upper, key=lambda artist: artist.get_zorder()):
            artist.draw(renderer)
        self._upper = [_Sheet(renderer)]

    def fix(self, time: float) -> None:
        """Show a moment [s] for good."""
        visible = {id(artist) for artist in self.show(time)}
        children: list[Any] = [*self._ax.get_children(), self._clock]
        for artist in children:
            if artist.get_animated():
                artist.set(animated=False, visible=id(artist) in visible)


class _Sheet:
    """A finished layer, as an artist; lies between hazards and bodies."""

    def __init__(self, renderer: Any) -> None:
        self._pixels = np.asarray(renderer.buffer_rgba())[::-1].copy()  # from the lowest row up

    def get_zorder(self) -> float:
        """Return an order over walls and names, under lines of equal heat or gas."""
        return 4.2

    def draw(self, renderer: Any) -> None:
        """Draw the layer over the ones below."""
        renderer.draw_image(renderer.new_gc(), 0, 0, self._pixels)


def _colour_of(verdict: RunVerdict) -> str:
    """Return the colour of the box with a run's outcome."""
    if not verdict.good:
        return style.FAILED
    return style.BEHIND_COLOUR if verdict.ahead < 0 else style.AHEAD_COLOUR


def _newest_line(timeline: Sequence[Moment], time: float) -> str:
    """Return the newest line of the story."""
    reports = [m for m in timeline if m.time <= time and m.kind != "link"]
    return f"{reports[-1].who} {reports[-1].what}".replace("_", " ") if reports else ""
