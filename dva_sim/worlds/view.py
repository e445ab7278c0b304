"""A site seen from above, as the ground on which tracks, robots and hazards are drawn."""

from __future__ import annotations

import math
import re
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.layout import FOOTPRINT
from dva_sim.worlds.parts import Exit
from dva_sim.worlds.site import Room, Site
from dva_sim.worlds.view_marks import draw_equipment, draw_north, draw_scale_bar, draw_views
from dva_sim.worlds.view_names import write_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
INK = "#59606a"
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
