"""A site seen from above: the ground on which tracks, robots and hazards are drawn, or by itself.

Names of rooms are written where they fit: smaller, in more lines, or turned; else left out. As a
picture of its own (a poster) it has a key.
"""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.site import FOOTPRINT, Site
from dva_sim.worlds.site_parts import Exit, Room
from dva_sim.worlds.view_marks import (
    CAMERA,
    DETECTORS,
    STATION,
    draw_equipment,
    draw_north,
    draw_scale_bar,
    draw_views,
    mast,
    points_per_metre,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


INK, FAINT_INK = "#59606a", "#7c8b6d"
SIZES = (7.5, 6.5, 5.5, 4.8, 4.2, 3.6)  # [pt]
LINE = 1.15  # height of a line, in font sizes
SLACK = 0.3  # of a line, as fonts are drawn in whole dots [font sizes]
GAP = 0.2  # between a name and the walls [m]
PLACES = 9  # tried along each side of a room
MOST_LINES = 3
# How much less legible a name is that is turned, covers something, is only a number.
TURNED, COVERING, ABRIDGED = 0.8, 0.6, 0.35


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
) -> tuple[NameLayout, float, float] | None:
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
def _settings(name: str) -> tuple[NameLayout, ...]:
    """All ways to write a name, the most legible first; at last only its number."""
    texts = [(text, 1.0) for text in _wraps(name)]
    number = re.search(r"\w?\d+$|\b[A-Z]$", name)
    texts += [(number[0], ABRIDGED)] if number else []
    ways = itertools.product(texts, SIZES, ((False, 1.0), (True, TURNED)))
    settings = [
        NameLayout(text, size, turned, worth * size * less)
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


def _box(setting: NameLayout) -> tuple[float, float]:
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


def _write(ax: Axes, room: Room, setting: NameLayout, x: float, y: float) -> None:
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


Floats = NDArray[np.float64]

# Soft floors, so that tracks and hazards stand out.
FLOORS = ("#eef3f8", "#f6f1e7", "#edf4ec", "#f6edf0", "#f0eff7", "#eaf4f4")
CORRIDOR = "#fbfbf9"
PAVING, GRASS = "#ece9e3", "#dfe9d4"
MAP_FLOOR = "#f5f4ef"
WALL, SOLID, SOLID_EDGE, DOOR = "#3a3f46", "#dcdfe3", "#b9bec6", "#b08c5a"
EXIT = "#009e73"
# Hues that differ for all eyes, and hatches that differ without hue.
ZONES = {
    "restricted": ("#d55e00", "////"),
    "charging": ("#0072b2", "\\\\\\\\"),
    "assembly": ("#009e73", "oo"),
}
# How coverage is shown: colour and opacity; good is left blank.
COVERAGE = {"fair": ("#f0e442", 0.24), "poor": ("#e69f00", 0.34), "none": ("#8f5b8a", 0.4)}
WALL_WIDTH = 0.14  # as drawn [m]
MARGIN = (0.8, 0.012)  # around the site: at least [m], of its width
BELOW = (0.6, 0.045)  # the same for the scale bar
ARC_POINTS = 9


def draw_site(
    ax: Axes,
    site: Site,
    labels: bool = True,
    coverage: bool = False,
    views: bool = False,
    scale: bool = True,
    small_marks: bool = True,
    least: float = 0.0,
) -> None:
    """Draw a site into `ax`, in metres, without axes.

    Everything lies below `zorder` 5; robots and people belong above.

    Args:
        ax: Where; its limits are set to the site.
        site: What.
        labels: Names, zones and equipment too, not only ground, walls, doors and exits.
        coverage: Where the radio link is not good, as a faint layer.
        views: What fixed cameras see, as a faint layer.
        scale: A bar below the site that tells lengths.
        small_marks: Detectors, cameras, antennas and guard posts among the equipment.
        least: Names that would have to be smaller than this are left out [pt].
    """
    set_limits(ax, site)
    if site.rooms:
        _draw_rooms(ax, site)
    else:
        _draw_grid(ax, site)
    _draw_walls(ax, site)
    _draw_doors(ax, site)
    for way in site.exits:
        _draw_exit(ax, way)
    if coverage:
        _draw_coverage(ax, site)
    if views:
        draw_views(ax, site)
    if labels:
        _draw_zones(ax, site)
        draw_equipment(ax, site, small_marks)
        write_names(ax, site, least)
        draw_north(ax, site)
    if scale:
        draw_scale_bar(ax, site)


def limits(site: Site) -> tuple[tuple[float, float], tuple[float, float]]:
    """What a picture of a site shows, scale bar and all: from x to x, from y to y [m]."""
    xmin, ymin, xmax, ymax = site.extent
    margin, below = (max(least, share * (xmax - xmin)) for least, share in (MARGIN, BELOW))
    return (xmin - margin, xmax + margin), (ymin - margin - below, ymax + margin)


def set_limits(ax: Axes, site: Site) -> None:
    """Make `ax` a map of a site, still empty, without axes."""
    across, up = limits(site)
    ax.set(xlim=across, ylim=up)
    ax.set_aspect("equal")
    ax.set_axis_off()


# --- ground ----------------------------------------------------------------------------
def _draw_rooms(ax: Axes, site: Site) -> None:
    """Yards below paths below rooms; rooms of one purpose have one colour."""
    from matplotlib.collections import PolyCollection

    tints: dict[str, str] = {}
    rooms = sorted(site.rooms, key=lambda room: (not room.outdoor, room.paved))
    colours = [_floor(room, tints) for room in rooms]
    polygons = [room.polygon for room in rooms]
    ax.add_collection(PolyCollection(polygons, facecolors=colours, edgecolors="none", zorder=1))
    solids = PolyCollection(list(site.solids), facecolors=SOLID, edgecolors=SOLID_EDGE, zorder=2)
    solids.set_linewidth(0.5)
    ax.add_collection(solids)


def _floor(room: Room, tints: dict[str, str]) -> str:
    if room.outdoor:
        return PAVING if room.paved else GRASS
    if "corridor" in room.name.lower():
        return CORRIDOR
    purpose = re.sub(r"\W*\b[A-Z]?\d*$", "", room.name)
    return tints.setdefault(purpose, FLOORS[len(tints) % len(FLOORS)])


def _draw_grid(ax: Axes, site: Site) -> None:
    """The floor of a bare map, and what stands on it."""
    from matplotlib.colors import ListedColormap
    from matplotlib.transforms import Affine2D
    from scipy import ndimage

    grid = site.grid
    floor = grid.floor(FOOTPRINT)
    shades = np.ma.masked_where(~ndimage.binary_fill_holes(floor), floor)
    rows, columns = grid.cells.shape
    turn = Affine2D().scale(grid.resolution).rotate(grid.origin.heading)
    image = ax.imshow(
        shades,
        cmap=ListedColormap([SOLID, MAP_FLOOR]),
        vmin=0,
        vmax=1,
        extent=(0, columns, 0, rows),
        origin="lower",
        interpolation="nearest",
        zorder=1,
    )
    image.set_transform(turn.translate(grid.origin.x, grid.origin.y) + ax.transData)
    set_limits(ax, site)  # which the image has moved


# --- walls and ways through them -------------------------------------------------------
def _draw_walls(ax: Axes, site: Site) -> None:
    """Walls as one shape in metres, so that they keep their width when somebody zooms."""
    import shapely

    width = WALL_WIDTH if site.rooms else WALL_WIDTH / 2
    lines = shapely.multilinestrings(site.wall_lines.reshape(-1, 2, 2))
    area = shapely.buffer(lines, width / 2, cap_style="square", join_style="mitre")
    _fill(ax, area, facecolor=WALL, edgecolor="none", zorder=3)


def _draw_doors(ax: Axes, site: Site) -> None:
    """Leaves that stand open, and the arcs they swing through."""
    from matplotlib.collections import LineCollection

    leaves, arcs = [], []
    busy = Counter(name for o in site.openings for name in (o.room_a, o.room_b) if name)
    for ends in site.doors:
        hinge, jamb = _hung(site, busy, ends)
        along = jamb - hinge
        turned = np.array([-along[1], along[0]])
        angle = np.linspace(0.0, math.pi / 2, ARC_POINTS)[:, None]
        arcs.append(hinge + along * np.cos(angle) + turned * np.sin(angle))
        leaves.append(np.array([hinge, hinge + turned]))
    ax.add_collection(LineCollection(leaves, colors=DOOR, linewidths=0.9, zorder=2.5))
    ax.add_collection(LineCollection(arcs, colors=DOOR, linewidths=0.5, alpha=0.7, zorder=2.5))


def _hung(site: Site, busy: Counter[str], ends: Floats) -> tuple[Floats, Floats]:
    """Hinge and jamb of a door whose leaf opens to the left: into the room with fewer ways."""
    hinge, jamb = ends[:2], ends[2:]
    along = (jamb - hinge) / max(math.dist(hinge, jamb), 1e-9)
    aside, middle = 0.3 * np.array([-along[1], along[0]]), (hinge + jamb) / 2
    left, right = (
        busy.get(site.room_at(*(middle + way).tolist()) or "", math.inf) for way in (aside, -aside)
    )
    return (hinge, jamb) if left <= right else (jamb, hinge)


def _draw_exit(ax: Axes, way: Exit) -> None:
    """A green bar in the wall and an arrow outwards."""
    x1, y1, x2, y2 = way.ends
    ax.plot([x1, x2], [y1, y2], color=EXIT, lw=2.4, solid_capstyle="butt", zorder=3.2)
    out = np.array([math.cos(way.heading), math.sin(way.heading)])
    side = np.array([-out[1], out[0]])
    size = min(0.62, 0.45 * way.width)
    foot = np.array([way.x, way.y]) + 0.12 * out
    corners = [foot + 0.8 * size * side, foot + size * out, foot - 0.8 * size * side]
    ax.fill(*np.array(corners).T, color=EXIT, lw=0, zorder=3.2)


# --- zones -----------------------------------------------------------------------------
def _hatch(ax: Axes, polygon: Floats, colour: str, hatch: str | None, **style: Any) -> None:
    from matplotlib.patches import Polygon

    patch = Polygon(polygon, fill=False, hatch=hatch, edgecolor=colour, **style)
    patch.set_hatch_linewidth(0.45)
    ax.add_patch(patch)


def _draw_zones(ax: Axes, site: Site) -> None:
    for zone in site.zones:
        colour, hatch = ZONES[zone.use]
        _hatch(ax, zone.polygon, colour, hatch, lw=0, alpha=0.35, zorder=1.4)
        _hatch(ax, zone.polygon, colour, None, lw=0.8, ls=(0, (4, 2)), alpha=0.8, zorder=3.1)


def _draw_coverage(ax: Axes, site: Site) -> None:
    """Each coverage where no later one is drawn over it."""
    import shapely

    above: Any = shapely.Polygon()
    for area in reversed(site.wifi):
        polygon = shapely.Polygon(area.polygon)
        if area.grade in COVERAGE:
            colour, alpha = COVERAGE[area.grade]
            _fill(ax, polygon - above, facecolor=colour, alpha=alpha, lw=0, zorder=1.6)
        above = above | polygon


def _fill(ax: Axes, area: Any, **style: Any) -> None:
    """A shapely area, holes and all."""
    import shapely
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    rings = shapely.get_rings(shapely.get_parts(area))
    if len(rings):
        paths = (Path(shapely.get_coordinates(ring), closed=True) for ring in rings)
        ax.add_patch(PathPatch(Path.make_compound_path(*paths), **style))


LONG_SIDE, MOST_INCHES = 8.4, 18.0  # of the picture [in]; a page shows 840 pixels of it
INCHES_PER_METRE = 0.07
FONT = 7.5  # of the key [pt]
KEY, KEY_LINE = 1.25, 0.17  # width of one of its entries, and height of a line [in]


def write_poster(site: Site, file: Path, coverage: bool, width: int) -> None:
    """Draw a site into an image file.

    Args:
        site: What.
        file: Where; its suffix gives the format.
        coverage: Show where the radio link is not good.
        width: Of the picture [pixels].

    Raises:
        ConfigError: the file cannot be written.
    """
    figure = poster(site, coverage)
    try:
        figure.savefig(file, dpi=width / figure.get_figwidth(), facecolor="white")
    except (OSError, ValueError) as error:
        raise ConfigError(f"cannot be written: {error}", file) from error


def poster(site: Site, coverage: bool) -> Figure:
    """The picture itself."""
    from matplotlib.figure import Figure

    (left, right), (low, high) = limits(site)
    across, up = right - left, high - low
    long = min(MOST_INCHES, max(LONG_SIDE, INCHES_PER_METRE * max(across, up)))
    width, height = (long * side / max(across, up) for side in (across, up))
    handles = _handles(site, coverage)
    columns = max(3, int(width / KEY))
    key = KEY_LINE * (math.ceil(len(handles) / columns) + 1)
    tall = height + key
    figure = Figure(figsize=(width, tall))
    ax = figure.add_axes((0, key / tall, 1, height / tall))
    draw_site(ax, site, coverage=coverage, views=not coverage)  # one wash of colour at a time
    if handles:
        figure.legend(
            handles=handles,
            loc="lower center",
            ncols=min(len(handles), columns),
            fontsize=FONT,
            frameon=False,
            labelcolor=INK,
            handletextpad=0.5,
            columnspacing=1.4,
        )
    return figure


def _handles(site: Site, coverage: bool) -> list[Artist]:
    """Only of what is there."""
    handles = [_mark("P", "guard post", INK)] if site.guard_posts else []
    if site.robot_bases:
        handles.insert(0, _mark("o", "robot base", INK, mfc="none", ms=6))
    for kind, (marker, colour) in DETECTORS.items():
        if any(detector.kind == kind for detector in site.detectors):
            label = f"{kind.upper() if kind == 'co' else kind} detector"
            handles.append(_mark(marker, label, colour, mfc="white", ms=4))
    if site.cameras:
        handles.append(_mark((3, 0, 0), "camera" if coverage else "camera, its view", CAMERA))
    if site.base_stations:
        handles.append(_mark(mast(), "base station", STATION, mfc="none", ms=8, mew=0.7))
    if site.exits:
        handles.append(_mark((3, 0, 180), "exit", EXIT, ms=6))
    return [*handles, *_areas(site, coverage)]


def _areas(site: Site, coverage: bool) -> list[Artist]:
    from matplotlib.patches import Patch

    outdoor = {room.paved for room in site.rooms if room.outdoor}
    found: list[Artist] = [Patch(fc=PAVING, label="path")] if True in outdoor else []
    found += [Patch(fc=GRASS, label="yard")] if False in outdoor else []
    for use in dict.fromkeys(zone.use for zone in site.zones):
        colour, hatch = ZONES[use]
        found.append(Patch(fc="none", ec=colour, hatch=hatch, lw=0.6, label=use))
    grades = {area.grade for area in site.wifi} if coverage else set()
    for grade in (grade for grade in COVERAGE if grade in grades):
        colour, alpha = COVERAGE[grade]
        label = "no Wi-Fi" if grade == "none" else f"{grade} Wi-Fi"
        found.append(Patch(fc=colour, alpha=alpha, label=label))
    return found


def _mark(marker: Any, label: str, colour: str, **style: Any) -> Artist:
    from matplotlib.lines import Line2D

    look = {"mfc": colour, "mec": colour, "mew": 0.8, "ms": 5, **style}
    return Line2D([], [], ls="none", marker=marker, label=label, **look)
