"""What stands on a site, as marks: detectors, bases, posts, desks, cameras, antennas."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.site import Site
from dva_sim.worlds.site_parts import FixedCamera

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.path import Path

Floats = NDArray[np.float64]

INK, DESK = "#59606a", "#c6cad0"
DETECTORS = {
    "smoke": ("o", "#9aa1ab"),
    "heat": ("D", "#d55e00"),
    "co": ("p", "#8f5b8a"),
    "gas": ("^", "#c79a2a"),
    "water": ("s", "#5b93c7"),
}
CAMERA, STATION = "#aa4499", "#332288"
POINTS_PER_INCH = 72.0
FULL_SIZE = 16.0  # scale at which marks have their full size [pt/m]
ARROW = 9.0  # half the length of the one to the north [pt]
RAYS = 61  # of a camera's field of view
BARS = (1, 2, 5, 10, 20, 50, 100)  # lengths of a scale bar [m]


def points_per_metre(ax: Axes) -> float:
    """The scale of the picture, which keeps its aspect."""
    figure: Any = ax.get_figure(root=True)
    _, _, width, height = ax.get_position().bounds
    inches = figure.get_size_inches()
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    across, up = width * inches[0] / (right - left), height * inches[1] / (high - low)
    return float(min(across, up)) * POINTS_PER_INCH


def scale_of(ax: Axes) -> float:
    """How large marks are: on a large site they are smaller, but not in proportion."""
    return min(1.1, max(0.45, math.sqrt(points_per_metre(ax) / FULL_SIZE)))


def draw_equipment(ax: Axes, site: Site, small_marks: bool = True) -> None:
    """Bases (a robot fits into the ring) and desks; unless the map is too small for them also
    detectors, guard posts, cameras and antennas."""
    _draw_bases(ax, site)
    _draw_desks(ax, site)
    if small_marks:
        _draw_small_marks(ax, site)


def _draw_small_marks(ax: Axes, site: Site) -> None:
    _draw_detectors(ax, site)
    for post in site.guard_posts:
        ax.plot(
            post.x,
            post.y,
            marker="P",
            ms=4.5 * scale_of(ax),
            mfc=INK,
            mec="white",
            mew=0.5,
            zorder=3.5,
        )
    for camera in site.cameras:
        _draw_camera(ax, camera)
    for station in site.base_stations:
        ax.plot(
            station.x,
            station.y,
            marker=mast(),
            ms=7 * scale_of(ax),
            mfc="none",
            mec=STATION,
            mew=0.7,
            zorder=3.6,
        )


def _draw_detectors(ax: Axes, site: Site) -> None:
    size = 2.6 * scale_of(ax)
    for kind, (marker, colour) in DETECTORS.items():
        points = [(d.x, d.y) for d in site.detectors if d.kind == kind]
        if points:
            x, y = zip(*points, strict=True)
            ax.plot(x, y, marker, ms=size, mfc="white", mec=colour, mew=0.7, zorder=3.5)


def _draw_bases(ax: Axes, site: Site) -> None:
    from matplotlib.patches import Circle

    for base in site.robot_bases:
        ring = Circle((base.x, base.y), 0.42, fill=False, ec=INK, lw=0.9, ls=(0, (2, 1.2)))
        ax.add_patch(ring).set_zorder(3.5)
        tip = base.x + 0.62 * math.cos(base.heading), base.y + 0.62 * math.sin(base.heading)
        ax.plot([base.x, tip[0]], [base.y, tip[1]], color=INK, lw=0.8, zorder=3.5)


def _draw_desks(ax: Axes, site: Site) -> None:
    from matplotlib.patches import Rectangle
    from matplotlib.transforms import Affine2D

    for desk in site.operator_desks if site.rooms else ():
        turn = Affine2D().rotate(desk.heading).translate(desk.x, desk.y) + ax.transData
        table = Rectangle((0.25, -0.7), 0.7, 1.4, fc=DESK, ec=INK, lw=0.5, zorder=3.5)
        table.set_transform(turn)
        ax.add_patch(table)
        ax.plot(desk.x, desk.y, "o", ms=2.6 * scale_of(ax), color=INK, zorder=3.5)


def _draw_camera(ax: Axes, camera: FixedCamera) -> None:
    look = (3, 0, math.degrees(camera.heading) - 90)
    size = 4.5 * scale_of(ax)
    ax.plot(camera.x, camera.y, marker=look, ms=size, color=CAMERA, mew=0, zorder=3.6)


def draw_views(ax: Axes, site: Site) -> None:
    """The floor that each fixed camera sees."""
    from matplotlib.patches import Polygon

    for camera in site.cameras:
        seen = Polygon(view_of(site, camera), facecolor=CAMERA, alpha=0.08, lw=0, zorder=1.8)
        ax.add_patch(seen)


def view_of(site: Site, camera: FixedCamera) -> Floats:
    """Corners `(n, 2)` [m] of what a camera sees up to its range; walls hide the rest."""
    spread = np.linspace(-0.5, 0.5, RAYS) * camera.field_of_view
    rays = np.stack([np.cos(camera.heading + spread), np.sin(camera.heading + spread)], axis=1)
    eye = np.array([camera.x, camera.y])
    start, along = site.walls[:, :2] - eye, site.walls[:, 2:] - site.walls[:, :2]
    across = rays[:, :1] * along[:, 1] - rays[:, 1:] * along[:, 0]  # (rays, walls)
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / across
        part = (start[:, 0] * rays[:, 1:] - start[:, 1] * rays[:, :1]) / across
    hits = np.where((far > 0) & (part >= 0) & (part <= 1), far, math.inf)
    reach = np.minimum(hits.min(axis=1, initial=math.inf), camera.range)
    return np.vstack([eye, eye + rays * reach[:, None]])


def mast() -> Path:
    """An antenna with a wave on both sides, as a marker."""
    from matplotlib.path import Path

    pole = Path([(0, -1), (0, 0.3)])
    waves = []
    for radius, start in itertools.product((0.45, 0.85), (-45, 135)):
        arc = Path.arc(start, start + 90)
        waves.append(Path(np.asarray(arc.vertices) * radius + (0.0, 0.3), arc.codes))
    return Path.make_compound_path(pole, *waves)


# --- scale and direction ---------------------------------------------------------------


def draw_scale_bar(ax: Axes, site: Site) -> None:
    """A bar of a round length, half dark and half light, below the site."""
    xmin, _, xmax, _ = site.extent
    length = max(n for n in BARS if n <= max(1.0, (xmax - xmin) / 4))
    y = _below(ax, site)
    style: dict[str, Any] = {"lw": 2.2, "solid_capstyle": "butt", "zorder": 4}
    ax.plot([xmin, xmin + length], [y, y], color=INK, **style)
    ax.plot([xmin + length / 2, xmin + 0.98 * length], [y, y], color="white", **style | {"lw": 1.2})
    gap = 5.0 / points_per_metre(ax)
    ax.text(xmin + length + gap, y, f"{length} m", va="center", fontsize=6.5, color=INK, zorder=4)


def draw_north(ax: Axes, site: Site) -> None:
    """An arrow to the north; a bare map does not say where that is."""
    if not site.rooms:
        return
    room = site.extent[1] - ax.get_ylim()[0]
    y, size = _below(ax, site), min(ARROW / points_per_metre(ax), 0.3 * room)
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
    """The middle of the room below the site [m]."""
    return (ax.get_ylim()[0] + site.extent[1]) / 2
