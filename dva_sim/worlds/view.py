"""A site seen from above, as the ground on which tracks, robots and hazards are drawn."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.worlds.maps import FREE
from dva_sim.worlds.site import Room, Site

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Soft floors, so that tracks and hazards stand out.
FLOORS = ("#eef3f8", "#f6f1e7", "#edf4ec", "#f6edf0", "#f0eff7", "#eaf4f4")
CORRIDOR = "#fbfbf9"
MAP_FLOOR = "#f5f4ef"
WALL, SOLID, DOOR, INK = "#3a3f46", "#c6cad0", "#b08c5a", "#59606a"
DETECTORS = {"smoke": ("o", "#9aa1ab"), "gas": ("^", "#c79a2a"), "water": ("s", "#5b93c7")}
WALL_WIDTH = 0.14  # as drawn [m]
MARGIN = 0.8  # around the site [m]
BAR_ROOM = 0.6  # below, for the scale bar [m]
NAME_INSET = 0.35  # of a room's name from its corner [m]


def draw_site(ax: Axes, site: Site, labels: bool = True) -> None:
    """Draw a site into `ax`, in metres, without axes.

    Everything lies below `zorder` 5; robots and people belong above.

    Args:
        ax: Where; its limits are set to the site.
        site: What.
        labels: Room names, bases, desks and detectors too, not only floor, walls and doors.
    """
    if site.rooms:
        _draw_rooms(ax, site)
    else:
        _draw_grid(ax, site)
    _draw_walls(ax, site)
    _draw_doors(ax, site)
    if labels:
        _draw_equipment(ax, site)
        for room in site.rooms:
            _write_name(ax, room)
    _draw_scale_bar(ax, site)
    xmin, ymin, xmax, ymax = site.extent
    ax.set_xlim(xmin - MARGIN, xmax + MARGIN)
    ax.set_ylim(ymin - MARGIN - BAR_ROOM, ymax + MARGIN)
    ax.set_aspect("equal")
    ax.set_axis_off()


def _draw_rooms(ax: Axes, site: Site) -> None:
    from matplotlib.patches import Polygon

    tint = 0
    for room in site.rooms:
        corridor = "corridor" in room.name.lower()
        colour = CORRIDOR if corridor else FLOORS[tint % len(FLOORS)]
        tint += not corridor
        ax.add_patch(Polygon(room.polygon, facecolor=colour, edgecolor="none", zorder=1))
    for corners in site.solids:
        ax.add_patch(Polygon(corners, facecolor=SOLID, edgecolor="none", zorder=2))


def _draw_grid(ax: Axes, site: Site) -> None:
    """The known-free floor of a bare map."""
    from matplotlib.colors import ListedColormap
    from matplotlib.transforms import Affine2D

    grid = site.grid
    rows, columns = grid.cells.shape
    turn = Affine2D().scale(grid.resolution).rotate(grid.origin.heading)
    image = ax.imshow(
        np.ma.masked_where(grid.cells != FREE, np.zeros(grid.cells.shape)),
        cmap=ListedColormap([MAP_FLOOR]),
        extent=(0, columns, 0, rows),
        origin="lower",
        interpolation="nearest",
        zorder=1,
    )
    image.set_transform(turn.translate(grid.origin.x, grid.origin.y) + ax.transData)


def _draw_walls(ax: Axes, site: Site) -> None:
    """Walls as one shape in metres, so that they keep their width when somebody zooms."""
    import shapely
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    width = WALL_WIDTH if site.rooms else WALL_WIDTH / 2
    lines = shapely.multilinestrings(site.walls.reshape(-1, 2, 2))
    area = shapely.buffer(lines, width / 2, cap_style="square", join_style="mitre")
    rings = shapely.get_rings(shapely.get_parts(area))
    if not len(rings):
        return
    path = Path.make_compound_path(*(Path(shapely.get_coordinates(r), closed=True) for r in rings))
    ax.add_patch(PathPatch(path, facecolor=WALL, edgecolor="none", zorder=3))


def _draw_doors(ax: Axes, site: Site) -> None:
    """A leaf that stands open and the arc it swings through."""
    from matplotlib.patches import Arc

    for x1, y1, x2, y2 in site.doors.tolist():
        width, angle = math.hypot(x2 - x1, y2 - y1), math.atan2(y2 - y1, x2 - x1)
        leaf = angle + math.pi / 2
        tip = (x1 + width * math.cos(leaf), y1 + width * math.sin(leaf))
        ax.plot([x1, tip[0]], [y1, tip[1]], color=DOOR, lw=1.0, zorder=2.5)
        degrees = math.degrees(angle)
        arc = Arc((x1, y1), 2 * width, 2 * width, angle=degrees, theta1=0, theta2=90)
        arc.set(color=DOOR, linewidth=0.6, alpha=0.7, zorder=2.5)
        ax.add_patch(arc)


def _draw_equipment(ax: Axes, site: Site) -> None:
    """Detectors, bases (a robot fits into the ring), guard posts and desks."""
    from matplotlib.patches import Circle, Rectangle
    from matplotlib.transforms import Affine2D

    for kind, (marker, colour) in DETECTORS.items():
        points = [(d.x, d.y) for d in site.detectors if d.kind == kind]
        if points:
            x, y = zip(*points, strict=True)
            ax.plot(x, y, marker, ms=2.6, mfc="white", mec=colour, mew=0.8, zorder=3.5)
    for base in site.robot_bases:
        ring = Circle((base.x, base.y), 0.42, fill=False, ec=INK, lw=0.9, ls=(0, (2, 1.2)))
        ax.add_patch(ring).set_zorder(3.5)
    for post in site.guard_posts:
        ax.plot(post.x, post.y, marker="P", ms=4.5, mfc=INK, mec="white", mew=0.5, zorder=3.5)
    for desk in site.operator_desks if site.rooms else ():
        turn = Affine2D().rotate(desk.heading).translate(desk.x, desk.y) + ax.transData
        table = Rectangle((0.25, -0.7), 0.7, 1.4, fc=SOLID, ec=INK, lw=0.5, zorder=3.5)
        table.set_transform(turn)
        ax.add_patch(table)
        ax.plot(desk.x, desk.y, "o", ms=2.6, color=INK, zorder=3.5)


def _write_name(ax: Axes, room: Room) -> None:
    """The room's name in its upper left corner; along a narrow room from south to north."""
    xmin, ymin = room.polygon.min(axis=0)
    xmax, ymax = room.polygon.max(axis=0)
    ax.text(
        xmin + NAME_INSET,
        ymax - NAME_INSET,
        room.name,
        ha="left",
        va="top",
        rotation=90 if ymax - ymin > 2.5 * (xmax - xmin) else 0,
        fontsize=6.5,
        color=INK,
        zorder=4,
        clip_on=True,
    )


def _draw_scale_bar(ax: Axes, site: Site) -> None:
    xmin, ymin, xmax, _ = site.extent
    length = max(n for n in (1, 2, 5, 10, 20, 50) if n <= max(1.0, (xmax - xmin) / 4))
    y = ymin - MARGIN
    ax.plot([xmin, xmin + length], [y, y], color=INK, lw=1.6, solid_capstyle="butt", zorder=4)
    ax.text(xmin + length + 0.4, y, f"{length} m", va="center", fontsize=6.5, color=INK, zorder=4)
