"""Marks of a site: detectors, bases, posts, desks, cameras, antennas; and names.

Names of rooms are written where they fit: smaller, in more lines, or turned; else left out.
"""

from __future__ import annotations

import itertools
import math
import re
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Circle, Polygon, Rectangle
from matplotlib.path import Path
from matplotlib.textpath import text_to_path
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from dva_sim.worlds.geo import Pose
from dva_sim.worlds.site import Site
from dva_sim.worlds.site_parts import BaseStation, FixedCamera

Floats = NDArray[np.float64]

INK = "#59606a"
FAINT_INK = "#7c8b6d"
DESK = "#c6cad0"
DETECTORS = {
    "smoke": ("o", "#9aa1ab"),
    "heat": ("D", "#d55e00"),
    "co": ("p", "#8f5b8a"),
    "gas": ("^", "#c79a2a"),
    "water": ("s", "#5b93c7"),
}
CAMERA = "#aa4499"
STATION = "#332288"
POINTS_PER_INCH = 72.0
FULL_SIZE = 16.0  # scale at which marks have their full size [pt/m]
ARROW = 9.0  # half the length of the arrow to the north [pt]
RAYS = 61  # rays of a camera's field of view
BARS = (1, 2, 5, 10, 20, 50, 100)  # lengths of a scale bar [m]


def points_per_metre(ax: Axes) -> float:
    """Return the scale of the picture, which keeps its aspect."""
    figure: Any = ax.get_figure(root=True)
    _, _, width, height = ax.get_position().bounds
    inches = figure.get_size_inches()
    left, right = ax.get_xlim()
    low, high = ax.get_ylim()
    across = width * inches[0] / (right - left)
    up = height * inches[1] / (high - low)
    return float(min(across, up)) * POINTS_PER_INCH


def choose_scale(ax: Axes) -> float:
    """Return the size of marks: smaller on a large site, but not in proportion."""
    return min(1.1, max(0.45, math.sqrt(points_per_metre(ax) / FULL_SIZE)))


def draw_equipment(ax: Axes, site: Site, small_marks: bool = True) -> None:
    """Bases (a robot fits into the ring) and desks; unless the map is too small for them also
    detectors, guard posts, cameras and antennas."""
    _draw_bases(ax, site)
    _draw_desks(ax, site)
    if small_marks:
        _draw_detectors(ax, site)
        for post in site.guard_posts:
            _mark(ax, post, "P", 4.5, mfc=INK, mec="white", mew=0.5, zorder=3.5)
        for camera in site.cameras:
            look = (3, 0, math.degrees(camera.heading) - 90)
            _mark(ax, camera, look, 4.5, color=CAMERA, mew=0, zorder=3.6)
        for station in site.base_stations:
            _mark(ax, station, mast(), 7, mfc="none", mec=STATION, mew=0.7, zorder=3.6)


def _mark(
    ax: Axes, at: Pose | FixedCamera | BaseStation, marker: Any, size: float, **style: Any
) -> None:
    ax.plot(at.x, at.y, marker=marker, ms=size * choose_scale(ax), **style)


def _draw_detectors(ax: Axes, site: Site) -> None:
    size = 2.6 * choose_scale(ax)
    for kind, (marker, colour) in DETECTORS.items():
        points = [(d.x, d.y) for d in site.detectors if d.kind == kind]
        if points:
            x, y = zip(*points, strict=True)
            ax.plot(x, y, marker, ms=size, mfc="white", mec=colour, mew=0.7, zorder=3.5)


def _draw_bases(ax: Axes, site: Site) -> None:
    for base in site.robot_bases:
        ring = Circle((base.x, base.y), 0.42, fill=False, ec=INK, lw=0.9, ls=(0, (2, 1.2)))
        ax.add_patch(ring).set_zorder(3.5)
        tip = base.x + 0.62 * math.cos(base.heading), base.y + 0.62 * math.sin(base.heading)
        ax.plot([base.x, tip[0]], [base.y, tip[1]], color=INK, lw=0.8, zorder=3.5)


def _draw_desks(ax: Axes, site: Site) -> None:
    for desk in site.operator_desks if site.rooms else ():
        turn = Affine2D().rotate(desk.heading).translate(desk.x, desk.y) + ax.transData
        table = Rectangle((0.25, -0.7), 0.7, 1.4, fc=DESK, ec=INK, lw=0.5, zorder=3.5)
        table.set_transform(turn)
        ax.add_patch(table)
        ax.plot(desk.x, desk.y, "o", ms=2.6 * choose_scale(ax), color=INK, zorder=3.5)


def draw_views(ax: Axes, site: Site) -> None:
    """Draw the floor that each fixed camera sees."""
    for camera in site.cameras:
        area = Polygon(view_of(site, camera), facecolor=CAMERA, alpha=0.08, lw=0, zorder=1.8)
        ax.add_patch(area)


def view_of(site: Site, camera: FixedCamera) -> Floats:
    """Return corners `(n, 2)` [m] of the floor in a camera's view, limited by walls and range."""
    spread = np.linspace(-0.5, 0.5, RAYS) * camera.field_of_view
    rays = np.stack([np.cos(camera.heading + spread), np.sin(camera.heading + spread)], axis=1)
    eye = np.array([camera.x, camera.y])
    start = site.walls[:, :2] - eye
    along = site.walls[:, 2:] - site.walls[:, :2]
    across = rays[:, :1] * along[:, 1] - rays[:, 1:] * along[:, 0]  # (rays, walls)
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / across
        part = (start[:, 0] * rays[:, 1:] - start[:, 1] * rays[:, :1]) / across
    hits = np.where((far > 0) & (part >= 0) & (part <= 1), far, math.inf)
    reach = np.minimum(hits.min(axis=1, initial=math.inf), camera.range)
    return np.vstack([eye, eye + rays * reach[:, None]])


def mast() -> Path:
    """Return an antenna with a wave on both sides, as a marker."""
    pole = Path([(0, -1), (0, 0.3)])
    waves = []
    for radius, start in itertools.product((0.45, 0.85), (-45, 135)):
        arc = Path.arc(start, start + 90)
        waves.append(Path(np.asarray(arc.vertices) * radius + (0.0, 0.3), arc.codes))
    return Path.make_compound_path(pole, *waves)


# --- names of rooms --------------------------------------------------------------------
SIZES = (7.5, 6.5, 5.5, 4.8, 4.2, 3.6)  # font sizes of names [pt]
LINE = 1.15  # height of a line, in font sizes
SLACK = 0.3  # spare room of a line, as fonts are drawn in whole dots [font sizes]
GAP = 0.2  # gap between a name and the walls [m]
PLACES = 9  # places tried along each side of a room
MAX_LINES = 3
# How much less legible a name is that is turned, covers something, is only a number.
TURNED_SHARE = 0.8
COVERING = 0.6
ABRIDGED = 0.35


class NameLayout(NamedTuple):
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
    metre = points_per_metre(ax)
    things = shapely.STRtree(_things(site))
    for room in site.rooms:
        area = site.ground_of(room).buffer(-GAP, join_style="mitre")
        layout = _best(area, room.name, things, metre, least)
        if layout is not None:
            setting, x, y = layout
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


def _things(site: Site) -> list[Any]:
    """Return the marks, door leaves and solids that names should not cover."""
    marks = [(d.x, d.y, 0.3) for d in site.detectors]
    marks += [(s.x, s.y, 0.5) for s in site.base_stations]
    marks += [(c.x, c.y, 0.3) for c in site.cameras]
    marks += [(p.x, p.y, 0.5) for p in (*site.robot_bases, *site.guard_posts)]
    marks += [(p.x, p.y, 0.9) for p in site.operator_desks]
    marks += [(exit_.x, exit_.y, 1.0) for exit_ in site.exits]
    leaves = [((a + c) / 2, (b + d) / 2, 0.9) for a, b, c, d in site.doors.tolist()]
    discs = [shapely.Point(x, y).buffer(radius) for x, y, radius in marks + leaves]
    return [*discs, *(shapely.Polygon(corners) for corners in site.solids)]


def _best(
    area: Any, name: str, things: Any, metre: float, least: float
) -> tuple[NameLayout, float, float] | None:
    """Return the most legible setting that fits, and where."""
    if area.is_empty:
        return None
    shapely.prepare(area)
    best = 0.0
    layout = None
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
            best = worth
            layout = (setting, *spots[np.argmin(covered)].tolist())
    return layout


@lru_cache(maxsize=4096)
def _settings(name: str) -> tuple[NameLayout, ...]:
    """Return all ways to write a name, the most legible first; the last is only its number."""
    texts = [(text, 1.0) for text in _wraps(name)]
    number = re.search(r"\w?\d+$|\b[A-Z]$", name)
    texts += [(number[0], ABRIDGED)] if number else []
    ways = itertools.product(texts, SIZES, ((False, 1.0), (True, TURNED_SHARE)))
    settings = [
        NameLayout(text, size, turned, worth * size * less)
        for (text, worth), size, (turned, less) in ways
    ]
    return tuple(sorted(settings, key=lambda setting: -setting.worth))


@lru_cache(maxsize=4096)
def _wraps(name: str) -> tuple[str, ...]:
    """Return the name in one line, and in the most even two and three lines."""
    words = name.split()
    texts = [name]
    for lines in range(2, min(MAX_LINES, len(words)) + 1):
        cuts = itertools.combinations(range(1, len(words)), lines - 1)
        wraps = [
            "\n".join(" ".join(words[a:b]) for a, b in itertools.pairwise((0, *cut, len(words))))
            for cut in cuts
        ]
        texts.append(min(wraps, key=lambda text: max(map(len, text.split("\n")))))
    return tuple(texts)


def _box(setting: NameLayout) -> tuple[float, float]:
    """Return the width and height of a setting [pt]."""
    lines = setting.text.split("\n")
    long = max(map(_width, lines)) * setting.size
    high = LINE * len(lines) * setting.size
    return (high, long) if setting.turned else (long, high)


@lru_cache(maxsize=4096)
def _width(line: str) -> float:
    """Return the width of a line, in font sizes."""
    font = FontProperties(size=10)
    width, _, _ = text_to_path.get_text_width_height_descent(line, font, ismath=False)
    return float(width) / 10 + SLACK


def _boxes(middles: NDArray[np.float64], width: float, height: float) -> Any:
    x, y = middles.T
    across = width / 2
    up = height / 2
    return shapely.box(x - across, y - up, x + across, y + up)


def _spots(area: Any, width: float, height: float) -> NDArray[np.float64]:
    """Return possible middles of a box, those near the middle of the area first."""
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


# --- scale and direction ---------------------------------------------------------------


def draw_scale_bar(ax: Axes, site: Site) -> None:
    """Draw a bar of a round length, half dark and half light, below the site."""
    xmin, _, xmax, _ = site.extent
    length = max(n for n in BARS if n <= max(1.0, (xmax - xmin) / 4))
    y = _below(ax, site)
    style: dict[str, Any] = {"lw": 2.2, "solid_capstyle": "butt", "zorder": 4}
    ax.plot([xmin, xmin + length], [y, y], color=INK, **style)
    ax.plot([xmin + length / 2, xmin + 0.98 * length], [y, y], color="white", **style | {"lw": 1.2})
    gap = 5.0 / points_per_metre(ax)
    ax.text(xmin + length + gap, y, f"{length} m", va="center", fontsize=6.5, color=INK, zorder=4)


def draw_north(ax: Axes, site: Site) -> None:
    """Draw an arrow to the north; a bare map does not say where that is."""
    if not site.rooms:
        return
    room = site.extent[1] - ax.get_ylim()[0]
    y = _below(ax, site)
    size = min(ARROW / points_per_metre(ax), 0.3 * room)
    x = site.extent[2] - 1.5 * size
    ax.fill(
        [x, x - 0.7 * size, x, x + 0.7 * size],
        [y + size, y - size, y - size / 2, y - size],
        color=INK,
        lw=0,
        zorder=4,
    )
    ax.text(x - 1.2 * size, y, "N", ha="right", va="center", fontsize=6.5, color=INK, zorder=4)


def _below(ax: Axes, site: Site) -> float:
    """Return the middle of the room below the site [m]."""
    return (ax.get_ylim()[0] + site.extent[1]) / 2
