"""Names of rooms, written where they fit: smaller, in more lines, or turned; else left out."""

from __future__ import annotations

import itertools
import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.site import Room, Site
from dva_sim.worlds.view_marks import points_per_metre

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, FAINT_INK = "#59606a", "#7c8b6d"
SIZES = (7.5, 6.5, 5.5, 4.8, 4.2, 3.6)  # [pt]
LINE = 1.15  # height of a line, in font sizes
SLACK = 0.3  # of a line, as fonts are drawn in whole dots [font sizes]
GAP = 0.2  # between a name and the walls [m]
PLACES = 9  # tried along each side of a room
MOST_LINES = 3
# How much less legible a name is that is turned, covers something, is only a number.
TURNED, COVERING, ABRIDGED = 0.8, 0.6, 0.35


class Setting(NamedTuple):
    """One way to write a name: with line breaks, of a size [pt], perhaps turned; how legible."""

    text: str
    size: float
    turned: bool
    worth: float


def write_names(ax: Axes, site: Site, least: float = 0.0) -> None:
    """Write the name of each room where it covers nothing, if it can.

    Args:
        ax: Its limits are those of the finished picture.
        site: Gives the rooms and what stands in them.
        least: A name that would have to be smaller is left out [pt].
    """
    import shapely

    metre = points_per_metre(ax)
    things = shapely.STRtree(_things(site))
    for number, room in enumerate(site.rooms):
        area: Any = shapely.Polygon(room.polygon)
        if room.outdoor:  # what is drawn over it takes its name's place
            area = area - shapely.union_all(
                [shapely.Polygon(r.polygon) for r in site.rooms[:number]]
            )
        found = _best(area.buffer(-GAP, join_style="mitre"), room.name, things, metre, least)
        if found is not None:
            setting, x, y = found
            _write(ax, room, setting, x, y)


def _things(site: Site) -> list[Any]:
    """What names should not cover."""
    import shapely

    marks = [(d.x, d.y, 0.3) for d in site.detectors]
    marks += [(s.x, s.y, 0.5) for s in site.base_stations]
    marks += [(c.x, c.y, 0.3) for c in site.cameras]
    marks += [(p.x, p.y, 0.5) for p in (*site.robot_bases, *site.guard_posts)]
    marks += [(p.x, p.y, 0.9) for p in site.operator_desks]
    marks += [(way.x, way.y, 1.0) for way in site.exits]
    leaves = [((a + c) / 2, (b + d) / 2, 0.9) for a, b, c, d in site.doors.tolist()]
    discs = [shapely.Point(x, y).buffer(radius) for x, y, radius in marks + leaves]
    return [*discs, *(shapely.Polygon(corners) for corners in site.solids)]


def _best(
    area: Any, name: str, things: Any, metre: float, least: float
) -> tuple[Setting, float, float] | None:
    """The most legible setting that fits, and where."""
    import shapely

    if area.is_empty:
        return None
    shapely.prepare(area)
    best, found = 0.0, None
    for setting in _settings(name):
        if setting.worth <= best:
            break  # they come from the most to the least legible
        if setting.size < least:
            continue
        width, height = (side / metre for side in _box(setting))
        spots = _spots(area, width, height)
        if not len(spots):
            continue
        hit = things.query(_boxes(spots, width, height), predicate="intersects")[0]
        covered = np.bincount(hit, minlength=len(spots))
        worth = setting.worth * (COVERING if covered.min() else 1.0)
        if worth > best:
            best, found = worth, (setting, *spots[np.argmin(covered)].tolist())
    return found


@lru_cache(maxsize=4096)
def _settings(name: str) -> tuple[Setting, ...]:
    """All ways to write a name, the most legible first; at last only its number."""
    texts = [(text, 1.0) for text in _wraps(name)]
    number = re.search(r"\w?\d+$|\b[A-Z]$", name)
    texts += [(number[0], ABRIDGED)] if number else []
    ways = itertools.product(texts, SIZES, ((False, 1.0), (True, TURNED)))
    settings = [
        Setting(text, size, turned, worth * size * less)
        for (text, worth), size, (turned, less) in ways
    ]
    return tuple(sorted(settings, key=lambda setting: -setting.worth))


@lru_cache(maxsize=4096)
def _wraps(name: str) -> tuple[str, ...]:
    """The name in one line, and in the most even two and three lines."""
    words = name.split()
    texts = [name]
    for lines in range(2, min(MOST_LINES, len(words)) + 1):
        cuts = itertools.combinations(range(1, len(words)), lines - 1)
        wraps = [
            "\n".join(" ".join(words[a:b]) for a, b in itertools.pairwise((0, *cut, len(words))))
            for cut in cuts
        ]
        texts.append(min(wraps, key=lambda text: max(map(len, text.split("\n")))))
    return tuple(texts)


def _box(setting: Setting) -> tuple[float, float]:
    """Width and height of a setting [pt]."""
    lines = setting.text.split("\n")
    long = max(map(_width, lines)) * setting.size
    high = LINE * len(lines) * setting.size
    return (high, long) if setting.turned else (long, high)


@lru_cache(maxsize=4096)
def _width(line: str) -> float:
    """Of a line, in font sizes."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=10)
    width, _, _ = text_to_path.get_text_width_height_descent(line, font, ismath=False)
    return float(width) / 10 + SLACK


def _boxes(middles: NDArray[np.float64], width: float, height: float) -> Any:
    import shapely

    (x, y), across, up = middles.T, width / 2, height / 2
    return shapely.box(x - across, y - up, x + across, y + up)


def _spots(area: Any, width: float, height: float) -> NDArray[np.float64]:
    """Where the middle of a box may lie, those near the middle of the area first."""
    import shapely

    xmin, ymin, xmax, ymax = area.bounds
    if width > xmax - xmin or height > ymax - ymin:
        return np.empty((0, 2))
    xs = np.linspace(xmin + width / 2, xmax - width / 2, PLACES)
    ys = np.linspace(ymin + height / 2, ymax - height / 2, PLACES)
    spots = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
    spots = spots[shapely.contains(area, _boxes(spots, width, height))]
    away = np.hypot(
        *((spots - ((xmin + xmax) / 2, (ymin + ymax) / 2)) / (xmax - xmin, ymax - ymin)).T
    )
    return np.asarray(spots[np.argsort(away, kind="stable")])


def _write(ax: Axes, room: Room, setting: Setting, x: float, y: float) -> None:
    ax.text(
        x,
        y,
        setting.text,
        ha="center",
        va="center",
        rotation=90 if setting.turned else 0,
        fontsize=setting.size,
        linespacing=LINE,
        color=FAINT_INK if room.outdoor and not room.paved else INK,
        zorder=4,
        clip_on=True,
    )
