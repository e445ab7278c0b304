"""A site seen from above: the ground on which tracks, robots and hazards are drawn, or by itself.

As a picture of its own (a poster) it has a key.
"""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray
from scipy import ndimage

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.whole_files import whole
from dva_sim.worlds.site import FOOTPRINT, Site
from dva_sim.worlds.site_parts import Exit
from dva_sim.worlds.tints import GRASS, PAVING, floor_tint
from dva_sim.worlds.view_marks import (
    CAMERA,
    DETECTORS,
    INK,
    STATION,
    draw_equipment,
    draw_north,
    draw_scale_bar,
    draw_views,
    mast,
    write_names,
)

Floats = NDArray[np.float64]

MAP_FLOOR = "#f5f4ef"
WALL = "#3a3f46"
SOLID = "#dcdfe3"
SOLID_EDGE = "#b9bec6"
DOOR = "#b08c5a"
EXIT = "#009e73"
# Hues that differ for all eyes, and hatches that differ without hue.
ZONES = {
    "restricted": ("#d55e00", "////"),
    "charging": ("#0072b2", "\\\\\\\\"),
    "assembly": ("#009e73", "oo"),
}
# How coverage is shown: colour and opacity; good is left blank.
COVERAGE = {"fair": ("#f0e442", 0.24), "poor": ("#e69f00", 0.34), "none": ("#8f5b8a", 0.4)}
WALL_WIDTH = 0.14  # drawn width of walls [m]
MARGIN = (0.8, 0.012)  # margin around the site: minimum [m], and share of the site's width
SCALE_BAR_PLACE = (0.6, 0.045)  # the same for the scale bar: minimum [m], and share of the width
ARC_POINTS = 9


def draw_site(
    ax: Axes,
    site: Site,
    *,
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
        ax: Axes to draw on; their limits are set to the site.
        site: Site to draw.
        labels: Names, zones and equipment too, not only ground, walls, doors and exits.
        coverage: Draw areas of poor radio, as a faint layer.
        views: Draw the views of fixed cameras, as a faint layer.
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
    for exit_ in site.exits:
        _draw_exit(ax, exit_)
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
    """Return the extent of a picture of a site, with the scale bar: ranges of x and of y [m]."""
    xmin, ymin, xmax, ymax = site.extent
    margin, below = (
        max(least, share * (xmax - xmin)) for least, share in (MARGIN, SCALE_BAR_PLACE)
    )
    return (xmin - margin, xmax + margin), (ymin - margin - below, ymax + margin)


def set_limits(ax: Axes, site: Site) -> None:
    """Make `ax` a map of a site, still empty, without axes."""
    across, up = limits(site)
    ax.set(xlim=across, ylim=up)
    ax.set_aspect("equal")
    ax.set_axis_off()


# --- ground ----------------------------------------------------------------------------
def _draw_rooms(ax: Axes, site: Site) -> None:
    """Draw yards below paths below rooms; rooms of one purpose have one colour."""
    tints: dict[str, str] = {}
    rooms = sorted(site.rooms, key=lambda room: (not room.outdoor, room.paved))
    colours = [floor_tint(room, tints) for room in rooms]
    outlines = [_outline(room.area) for room in rooms]
    ax.add_collection(PathCollection(outlines, facecolors=colours, edgecolors="none", zorder=1))
    solids = PolyCollection(list(site.solids), facecolors=SOLID, edgecolors=SOLID_EDGE, zorder=2)
    solids.set_linewidth(0.5)
    ax.add_collection(solids)


def _draw_grid(ax: Axes, site: Site) -> None:
    """Draw the floor of a bare map, and the obstacles on it."""
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
    """Draw walls as one shape in metres, so that zooming keeps their width in proportion."""
    width = WALL_WIDTH if site.rooms else WALL_WIDTH / 2
    lines = shapely.multilinestrings(site.wall_lines.reshape(-1, 2, 2))
    area = shapely.buffer(lines, width / 2, cap_style="square", join_style="mitre")
    _fill(ax, area, facecolor=WALL, edgecolor="none", zorder=3)


def _draw_doors(ax: Axes, site: Site) -> None:
    """Draw leaves that stand open, and the arcs they swing through."""
    leaves = []
    arcs = []
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
    hinge = ends[:2]
    jamb = ends[2:]
    along = (jamb - hinge) / max(math.dist(hinge, jamb), 1e-9)
    aside = 0.3 * np.array([-along[1], along[0]])
    middle = (hinge + jamb) / 2
    left, right = (
        busy.get(site.room_at(*(middle + offset).tolist()) or "", math.inf)
        for offset in (aside, -aside)
    )
    return (hinge, jamb) if left <= right else (jamb, hinge)


def _draw_exit(ax: Axes, exit_: Exit) -> None:
    """Draw a green bar in the wall and an arrow outwards."""
    x1, y1, x2, y2 = exit_.ends
    ax.plot([x1, x2], [y1, y2], color=EXIT, lw=2.4, solid_capstyle="butt", zorder=3.2)
    out = np.array([math.cos(exit_.heading), math.sin(exit_.heading)])
    side = np.array([-out[1], out[0]])
    size = min(0.62, 0.45 * exit_.width)
    foot = np.array([exit_.x, exit_.y]) + 0.12 * out
    corners = [foot + 0.8 * size * side, foot + size * out, foot - 0.8 * size * side]
    ax.fill(*np.array(corners).T, color=EXIT, lw=0, zorder=3.2)


# --- zones -----------------------------------------------------------------------------
def _hatch(ax: Axes, area: Any, colour: str, hatch: str | None, **style: Any) -> None:
    patch = PathPatch(_outline(area), fill=False, hatch=hatch, edgecolor=colour, **style)
    patch.set_hatch_linewidth(0.45)
    ax.add_patch(patch)


def _draw_zones(ax: Axes, site: Site) -> None:
    for zone in site.zones:
        colour, hatch = ZONES[zone.use]
        _hatch(ax, zone.area, colour, hatch, lw=0, alpha=0.35, zorder=1.4)
        _hatch(ax, zone.area, colour, None, lw=0.8, ls=(0, (4, 2)), alpha=0.8, zorder=3.1)


def _draw_coverage(ax: Axes, site: Site) -> None:
    """Draw each coverage where no later one is drawn over it."""
    above: Any = shapely.Polygon()
    for area in reversed(site.wifi):
        polygon = area.area
        if area.grade in COVERAGE:
            colour, alpha = COVERAGE[area.grade]
            _fill(ax, polygon - above, facecolor=colour, alpha=alpha, lw=0, zorder=1.6)
        above = above | polygon


def _fill(ax: Axes, area: Any, **style: Any) -> None:
    """Fill a shapely area, holes and all."""
    if not area.is_empty:
        ax.add_patch(PathPatch(_outline(area), **style))


def _outline(area: Any) -> Outline:
    """Return the rings of a shapely area: outwards and holes turn opposite ways."""
    oriented = shapely.get_parts(shapely.orient_polygons(area))
    rings = (shapely.get_coordinates(ring) for ring in shapely.get_rings(oriented))
    return Outline.make_compound_path(*(Outline(ring, closed=True) for ring in rings))


LONG_SIDE = 8.4  # long side of the picture; a page shows it 840 pixels wide [in]
MAX_INCHES = 18.0  # maximum side of the picture [in]
INCHES_PER_METRE = 0.07
FONT = 7.5  # font size of the key [pt]
KEY = 1.25  # width of an entry of the key [in]
KEY_LINE = 0.17  # height of a line of the key [in]


def write_poster(site: Site, file: Path, coverage: bool, width: int) -> None:
    """Draw a site into an image file.

    Args:
        site: Site to draw.
        file: Output file; its suffix gives the format.
        coverage: Show where the radio link is not good.
        width: Width of the picture [pixels].

    Raises:
        ConfigError: the file cannot be written.
    """
    figure = poster(site, coverage)
    try:
        with whole(file) as part:
            figure.savefig(part, dpi=width / figure.get_figwidth(), facecolor="white")
    except (OSError, ValueError) as error:
        raise ConfigError(f"cannot be written: {error}", file) from error


def poster(site: Site, coverage: bool) -> Figure:
    """Return the picture itself."""
    (left, right), (low, high) = limits(site)
    across = right - left
    up = high - low
    long = min(MAX_INCHES, max(LONG_SIDE, INCHES_PER_METRE * max(across, up)))
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
    """Return handles of the marks that the site has."""
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
    outdoor = {room.paved for room in site.rooms if room.outdoor}
    artists: list[Artist] = [Patch(fc=PAVING, label="path")] if True in outdoor else []
    artists += [Patch(fc=GRASS, label="yard")] if False in outdoor else []
    for use in dict.fromkeys(zone.use for zone in site.zones):
        colour, hatch = ZONES[use]
        artists.append(Patch(fc="none", ec=colour, hatch=hatch, lw=0.6, label=use))
    grades = {area.grade for area in site.wifi} if coverage else set()
    for grade in (grade for grade in COVERAGE if grade in grades):
        colour, alpha = COVERAGE[grade]
        label = "no Wi-Fi" if grade == "none" else f"{grade} Wi-Fi"
        artists.append(Patch(fc=colour, alpha=alpha, label=label))
    return artists


def _mark(marker: Any, label: str, colour: str, **style: Any) -> Artist:
    look = {"mfc": colour, "mec": colour, "mew": 0.8, "ms": 5, **style}
    return Line2D([], [], ls="none", marker=marker, label=label, **look)
