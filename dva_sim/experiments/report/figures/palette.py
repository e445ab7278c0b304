"""Every colour a figure may use, each with what carries it in a print: a mark, or a hatch.

Colours of lines and marks are those of Okabe & Ito, without the yellow that white paper swallows,
and eight more, chosen to stay far from all others under each of the three dichromacies.

References:
    Okabe, M. & Ito, K. (2008). Color universal design: how to make figures and presentations that
        are friendly to colorblind people.

Which mark is what: a key above the panels, or names at the ends of lines.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from dva_sim.experiments.analysis.run_grid import Factor
from dva_sim.experiments.study.parts import Level
from dva_sim.network.patterns import PATTERNS

if TYPE_CHECKING:
    pass


INK = "#222222"
SOFT = "#6b6b6b"
FAINT = "#d9d9d9"
PAPER = "white"
WARNING = "#8a3800"
HAZARD = "#8a0000"
DIVERGING = "PuOr_r"  # purple below zero, white, orange above: far apart for every eye


class Look(NamedTuple):
    """Style of a line and its markers."""

    colour: str
    mark: str


class Fill(NamedTuple):
    """Fill of a surface: colour and white hatching."""

    colour: str
    hatch: str = ""


_BLUE = Look("#0072B2", "o")
_VERMILION = Look("#D55E00", "s")
_GREEN = Look("#009E73", "^")
_PURPLE = Look("#CC79A7", "D")
_ORANGE = Look("#E69F00", "v")
_SKY = Look("#56B4E9", "P")
_BLACK = Look("#222222", "X")
_VIOLET = Look("#7a2fd0", "*")
_BROWN = Look("#613305", "h")
_OLIVE = Look("#b4b464", "<")
_PLUM = Look("#91086f", ">")
_CRIMSON = Look("#da0b3f", "d")
_NAVY = Look("#2929a3", "p")
_MINT = Look("#87c5a6", "8")
_LILAC = Look("#906ef7", "H")
LOOKS = (
    *(_BLUE, _VERMILION, _GREEN, _PURPLE, _ORANGE, _SKY, _BLACK, _VIOLET),
    *(_BROWN, _OLIVE, _PLUM, _CRIMSON, _NAVY, _MINT, _LILAC),
)
SINGLE_LOOK = Look(_VIOLET.colour, "o")  # a difference, or what stands alone

_OF_PATTERNS = (_VERMILION, _PURPLE, _BROWN, _BLUE, _GREEN)
_FREE = (  # of levels without a look of their own, in turn; those of patterns come last
    *(look for look in LOOKS if look not in (*_OF_PATTERNS, _VIOLET)),
    *(_OF_PATTERNS),
)
_NAMED = {
    "vermilion": _VERMILION,
    "purple": _PURPLE,
    "brown": _BROWN,
    "blue": _BLUE,
    "green": _GREEN,
}  # as patterns say

# Levels that look the same in every figure of every study. Beside patterns nothing else has a
# pattern's colour; only policies do, of which there are too many, and which shifts alone have.
_OWN: Mapping[str, Look] = {
    **{name: _NAMED[kind.colour] for name, kind in PATTERNS.items()},
    "robot": Look(_NAVY.colour, "o"),
    "guard": Look(_ORANGE.colour, "s"),
    "bystander": Look(_OLIVE.colour, "^"),
    "random": _BLACK,
    "nearest_idle": _BROWN,
    "min_eta": _BLUE,
    "priority_eta": _SKY,
    "batch_optimal": _GREEN,
    "auction": _ORANGE,
    "preemptive": _PURPLE,
    "hazard_team": _VERMILION,
    "operator_aware": _LILAC,
    "coverage": _PLUM,
    "preference": _OLIVE,
    "oracle": _CRIMSON,
}

# What may become of an event, the best first. In a stack neighbours differ in a print, too.
FATES: Mapping[str, Fill] = {
    "confirmed": Fill("#87c5a6"),
    "cleared": Fill("#56B4E9", "----"),
    "refuted": Fill(HAZARD, "...."),
    "false alarm confirmed": Fill(HAZARD, "xxxx"),
    "link lost": Fill("#91086f", "////"),
    "given up": Fill("#777777", "----"),
    "escalated": Fill("#906ef7", "\\\\\\\\"),
    "open": Fill("#dedede"),
    "expired": Fill("#b4b464", "++++"),
    "never reported": Fill("#222222", "||||"),
    "nothing": Fill("#dedede"),
}

# The way around the loop, from what the camera saw: blue the link, grey the person, orange the
# phone, each of them pale or dark; red is what the pattern costs. Hatched is what holds a value
# until the next one comes.
STAGES: Mapping[str, Fill] = {
    "delay_frame_s": Fill("#d3ebf8", "////"),
    "delay_downlink_s": Fill("#56b4e9"),
    "delay_human_s": Fill("#d4d4d4"),
    "delay_hand_s": Fill("#777777"),
    "delay_filter_s": Fill("#e69f00"),
    "delay_period_s": Fill("#fbe3a6", "////"),
    "delay_wait_s": Fill("#da0b3f"),
    "delay_uplink_s": Fill("#00507d"),
    "delay_processing_s": Fill("#b4b464"),
    "delay_motor_s": Fill("#222222"),
}


def looks(factor: Factor | None) -> dict[Level, Look]:
    """Return a look for each level.

    One's own, wherever it appears, or one that no other here has.
    """
    if factor is None:
        return {None: SINGLE_LOOK}
    fixed = {level: _OWN[str(level)] for level in factor.levels if str(level) in _OWN}
    taken = {look.colour for look in fixed.values()}
    free = [look for look in _FREE if look.colour not in taken] or list(_FREE)
    free_levels = [level for level in factor.levels if level not in fixed]
    look_by_level = fixed | {level: free[i % len(free)] for i, level in enumerate(free_levels)}
    return {level: look_by_level[level] for level in factor.levels}


def colours(factor: Factor | None) -> dict[Level, str]:
    """Return a colour for each level."""
    return {level: look.colour for level, look in looks(factor).items()}


def is_of_palette(colour: str) -> bool:
    """Return True if a colour, as `#rrggbb`, may be used in figures."""
    own = [INK, SOFT, FAINT, WARNING, HAZARD, "#ffffff", *(look.colour for look in LOOKS)]
    fills = [fill.colour for kind in (FATES, STAGES) for fill in kind.values()]
    return colour.lower() in {own_colour.lower() for own_colour in (*own, *fills)}


def look_of(name: str) -> Look:
    """Return the style for a kind of agent, or the default."""
    return _OWN.get(name, SINGLE_LOOK)
