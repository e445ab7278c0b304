"""A site as a picture of its own, with a title and a legend."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.layout import Site
from dva_sim.worlds.view import COVERAGE, EXIT, GRASS, INK, PAVING, ZONES, draw_site, limits
from dva_sim.worlds.view_marks import CAMERA, DETECTORS, STATION, mast

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

LONG_SIDE, MOST_INCHES = 8.4, 18.0  # of the picture [in]; a page shows 840 pixels of it
INCHES_PER_METRE = 0.07
FONT = 7.5  # of the key [pt]
KEY, LINE = 1.25, 0.17  # width of one of its entries, and height of a line [in]


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
    key = LINE * (math.ceil(len(handles) / columns) + 1)
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
