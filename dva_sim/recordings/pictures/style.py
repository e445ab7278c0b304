"""Colours, sizes and the legend of pictures from above."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from matplotlib.artist import Artist
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from dva_sim.recordings.pictures.colours import (
    ACTIVITIES,
    BYSTANDER,
    FIRE,
    GAS,
    GUARD,
    KINDS,
    ROBOT,
    ROBOT_MODES,
    SMOKE,
    WATER,
)
from dva_sim.recordings.pictures.moments import Moments

INK = "#2b3038"
HALO = "white"
GHOST = "#e07a00"
WIDTH = 8.4  # width of a picture [in]; a page shows it 840 pixels wide
FONT = 8.0  # font size of labels [points]: 11 pixels on such a page
TITLE = 10.0  # font size of titles [points]
MIN_NAME_POINTS = 6.5  # font size of names on the ground [points]: 9 pixels on such a page
ROOMY = 10.0  # scale from which a map has room for small marks [points/m]
AHEAD_COLOUR = "#1b7a3d"
BEHIND_COLOUR = "#59606a"
FAILED = "#a03030"
ENDS = (AHEAD_COLOUR, BEHIND_COLOUR, FAILED)  # colours of the endings of runs
SMALLEST = {ROBOT: 8.5, GUARD: 7.5, BYSTANDER: 4.5}  # minimum diameters on any site [points]
TRAIL_S = 40.0  # time in which a trail's colour falls to a third [s]

SHAPES = {ROBOT: "s", GUARD: "o", BYSTANDER: "o"}

# Outlines of bodies of diameter 1 that head east: a box with a bow, a disc with a beak.
_BEAK = tuple(
    (0.5 * math.cos(angle), 0.5 * math.sin(angle))
    for angle in (math.radians(degrees) for degrees in range(48, 313, 12))
)
OUTLINES = {
    ROBOT: ((0.8, 0.0), (0.32, 0.48), (-0.5, 0.48), (-0.5, -0.48), (0.32, -0.48)),
    GUARD: ((0.82, 0.0), *_BEAK),
    BYSTANDER: ((0.82, 0.0), *_BEAK),
}
LENGTHS = {ROBOT: 1.6, GUARD: 1.64, BYSTANDER: 1.64}  # lengths of the marker box, twice the bow

SMALL = (*ROBOT_MODES.values(), *ACTIVITIES.values(), FIRE, GAS, WATER, GHOST, *ENDS)
GAS_LEVELS = (0.1, 0.2, 0.5, 1.0)  # shares of the lower explosive limit
HEAT_LEVELS = (1.0, 2.5, 10.0)  # levels of heat flux [kW/m2]; skin bears 2.5 for long


def choose_colour(kind: str, mode: str) -> str:
    """Return the colour of an activity."""
    if kind == BYSTANDER and mode == "walking":
        return KINDS[kind]  # green is for guards
    modes = ROBOT_MODES if kind == ROBOT else ACTIVITIES
    return modes.get(mode, KINDS.get(kind, INK))


def legend(moments: Iterable[Moments]) -> list[Artist]:
    """Return a key for what occurs in some runs."""
    runs = list(moments)
    handles = []
    for kind in (ROBOT, GUARD, BYSTANDER):
        names = [(run, name) for run in runs for name in run.names(kind)]
        modes = {p.mode: None for run, name in names for p in run.tracks[name]}
        for mode in sorted(modes, key=_order):
            handles.append(_dot(SHAPES[kind], choose_colour(kind, mode), f"{kind}: {mode.lower()}"))
    looks = {title: hazard for run in runs for title, hazard in run.looks.items()}
    for title, hazard in sorted(looks.items()):
        handles.append(_dot(hazard.mark, hazard.colour, title))
    if any(run.recording.recorder.views for run in runs):
        label = "as the operator sees it"
        handles.append(_dot("o", "none", label, GHOST))
    handles += _fields({what for run in runs for what in run.shown})
    return handles


def _fields(kinds: set[str]) -> list[Artist]:
    handles: list[Artist] = []
    if "smoke" in kinds:
        handles.append(Patch(fc=SMOKE, alpha=0.5, label="smoke"))
    if "heat" in kinds:
        levels = ", ".join(f"{level:g}" for level in HEAT_LEVELS)
        handles.append(Line2D([], [], color=FIRE, lw=1, label=f"heat {levels} kW/m²"))
    if "gas" in kinds:
        levels = ", ".join(f"{100 * level:.0f}" for level in GAS_LEVELS)
        handles.append(Line2D([], [], color=GAS, lw=1, label=f"gas {levels} % of LEL"))
    if "water" in kinds:
        handles.append(Patch(fc=WATER, alpha=0.5, label="water"))
    return handles


def _dot(shape: str, colour: str, label: str, edge: str = "white") -> Any:
    return Line2D([], [], ls="none", marker=shape, mfc=colour, mec=edge, ms=7, label=label)


def _order(mode: str) -> tuple[int, str]:
    """Return the rank of a mode in the legend: in the order above, unlisted ones last."""
    ordered = [*ROBOT_MODES, *ACTIVITIES]
    return (ordered.index(mode) if mode in ordered else len(ordered)), mode
