"""One run on one map: the site, its hazards, everybody on it, and what is told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.pictures import style
from dva_sim.experiments.pictures.bodies import Body
from dva_sim.experiments.pictures.fields import LAYER, Fields
from dva_sim.experiments.pictures.moments import BYSTANDER, GUARD, ROBOT, Moments
from dva_sim.experiments.pictures.names import Names
from dva_sim.recorder import Moment

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes


class Scene:
    """A map that can show any moment of a run.

    Args:
        ax: Where.
        moments: The run.
        title: Above the map on the left.
        tell: Whether to write the newest line of the story below it.
    """

    def __init__(self, ax: Axes, moments: Moments, title: str = "", tell: bool = True) -> None:
        from dva_sim.worlds.view import draw_site

        self._ax, self._moments = ax, moments
        self._timeline = moments.recording.recorder.timeline if tell else []
        draw_site(ax, moments.recording.site)
        # What hazards must not cover is drawn after them.
        self._upper: list[Any] = [artist for artist in ax.get_children() if _stands_out(artist)]
        for artist in self._upper:
            artist.set_animated(True)
        limits = ax.get_xlim(), ax.get_ylim()
        names = moments.names(BYSTANDER, GUARD, ROBOT)
        self._fields = Fields(ax, moments)
        self._bodies = [Body(ax, moments, name) for name in names]
        self._names = Names(ax, self._bodies)
        ax.set(xlim=limits[0], ylim=limits[1], aspect="equal")
        self._clock = ax.set_title("", loc="right", fontsize=10, pad=1)
        # Between the scale bar and the arrow that points north.
        self._told = ax.text(
            0.65, 0.005, "", transform=ax.transAxes, ha="center", va="bottom",
            fontsize=style.FONT + 0.5, color=style.INK, animated=True,
        )  # fmt: skip
        self._clock.set_animated(True)
        ax.set_title(title, fontsize=10, loc="left", pad=1)

    def show(self, time: float) -> list[Artist]:
        """Artists that change, as they are at a moment [s], the lowest first."""
        artists = [*self._fields.show(time), *self._upper]
        for body in self._bodies:
            artists += body.show(time)
        sources = [incident.hazard.position for incident in self._moments.going_on(time)]
        artists += self._names.show(time, sources)
        artists.sort(key=lambda artist: artist.get_zorder())
        self._told.set_text(_told(self._timeline, time))
        self._clock.set_text(f"{min(time, self._moments.recording.duration):.1f} s")
        return [*artists, self._told, self._clock]

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
    from matplotlib.axis import Axis
    from matplotlib.spines import Spine

    return artist.get_zorder() > LAYER and not isinstance(artist, Axis | Spine)


def _told(timeline: Sequence[Moment], time: float) -> str:
    """The newest line of the story."""
    told = [m for m in timeline if m.time <= time and m.kind != "link"]
    return f"{told[-1].who} {told[-1].what}".replace("_", " ") if told else ""
