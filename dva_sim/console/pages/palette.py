"""The colours of the pages: those of the reports and films, in light and in dark.

Colours mean "look here": idle robots and good links are grey, floors pale. Nothing is shown by
colour alone; each mode, severity and state has a glyph and a word, too. This module writes
`static/palette.css` (custom properties) and `static/js/palette.js` (the same for canvases):

    python -m dva_sim.console.pages.palette
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from dva_sim.experiments.report.figures.palette import INK, look_of
from dva_sim.network.patterns import PATTERNS
from dva_sim.recordings.pictures.colours import FIRE, GAS, KINDS, ROBOT_MODES, SMOKE, WATER
from dva_sim.worlds import tints, view
from dva_sim.worlds.hazards import KINDS as HAZARDS

STATIC = Path(__file__).parent.parent / "static"
TEXT, MARK = 4.5, 3.0  # contrast that words and marks need at least (WCAG 2.2)

_DARK_INK = "#16191d"
Palette = Mapping[str, str]


def _floors(*dark: str) -> dict[str, tuple[str, str]]:
    return {f"floor-{i}": pair for i, pair in enumerate(zip(tints.FLOORS, dark, strict=True))}


# What it is for: in light, in dark.
COLOURS: Mapping[str, tuple[str, str]] = {
    "page": ("#f7f7f5", "#16191d"),
    "card": ("#ffffff", "#1f242a"),
    "raised": ("#eeeeeb", "#2a3038"),
    "line": ("#d9d9d9", "#3a414a"),
    "edge": ("#85898f", "#78818b"),
    "ink": (INK, "#e8eaed"),
    "soft": ("#5f6368", "#a4acb6"),
    "focus": ("#0072b2", "#56b4e9"),
    "on-focus": ("#ffffff", _DARK_INK),
    "danger": ("#8a0000", "#ff6b6b"),
    "stop": ("#a30000", "#c62828"),
    "on-stop": ("#ffffff", "#ffffff"),
    "warning": ("#b84a00", "#ff9a4d"),
    # --- plan
    **_floors("#2a3038", "#2f2d29", "#29302b", "#302a2d", "#2c2c33", "#293030"),
    "corridor": (tints.CORRIDOR, "#262b32"),
    "paving": (tints.PAVING, "#2d2c2a"),
    "grass": (tints.GRASS, "#242c22"),
    "map-floor": (view.MAP_FLOOR, "#2a3038"),
    "outside": ("#e6e6e2", "#101316"),
    "wall": (view.WALL, "#8b939c"),
    "solid": (view.SOLID, "#3d444d"),
    "solid-edge": (view.SOLID_EDGE, "#535b65"),
    "door": (view.DOOR, "#b59469"),
    "exit": (view.EXIT, "#3cc79a"),
    "room-name": ("#59606a", "#a4acb6"),
    "outline": (INK, "#e8eaed"),
    "halo": ("#ffffff", _DARK_INK),
    # --- robots and people
    "idle": ("#6f7986", "#98a2ae"),
    "mission": (ROBOT_MODES["Mission"], "#56b4e9"),
    "teleoperation": (ROBOT_MODES["Teleoperation"], "#b58cff"),
    "manual": ("#8a6100", "#e6c34a"),
    "emergency": ("#8a0000", "#ff6b6b"),
    "guard": (KINDS["guard"], "#6fbf73"),
    "bystander": (KINDS["bystander"], "#c4a48f"),
    # --- hazards
    "fire": (FIRE, "#ff5c5c"),
    "gas": (GAS, "#e6c34a"),
    "water": (WATER, "#56b4e9"),
    "smoke": (SMOKE, "#a4acb6"),
    # --- severity: fill, and what is written on it
    "critical": ("#8a0000", "#ff5c5c"),
    "on-critical": ("#ffffff", _DARK_INK),
    "high": ("#e69f00", "#e69f00"),
    "on-high": (INK, _DARK_INK),
    "medium": ("#f0e442", "#f0e442"),
    "on-medium": (INK, _DARK_INK),
    # --- how good a link is
    "link-good": ("#5f6368", "#a4acb6"),
    "link-fair": ("#8a6100", "#e6c34a"),
    "link-poor": ("#b84a00", "#ff9a4d"),
    "link-lost": ("#8a0000", "#ff7a7a"),
    # --- states of events
    "state-pending": ("#b84a00", "#ff9a4d"),
    "state-assigned": ("#0072b2", "#56b4e9"),
    "state-on-scene": ("#7d2fb8", "#b58cff"),
    "state-confirmed": ("#00704f", "#3cc79a"),
    "state-contained": ("#2f7d32", "#6fbf73"),
    "state-refuted": ("#9b4a78", "#e58fc0"),
    "state-escalated": ("#8a0000", "#ff6b6b"),
    "state-expired": ("#613305", "#c4a48f"),
}

# Lines of patterns in charts: as in reports, but light enough for a dark card, dark enough for a
# white one.
_LINES = {"#0072b2": ("#0072b2", "#56b4e9"), "#d55e00": ("#d55e00", "#ff9a4d"),
          "#009e73": ("#00845f", "#3cc79a"), "#cc79a7": ("#b0578a", "#e58fc0"),
          "#613305": ("#613305", "#c9a26b")}  # fmt: skip

_WORDS = ("soft", "ink", "focus", "warning", "danger", "idle", "mission", "teleoperation",
          "manual", "emergency", "link-good", "link-fair", "link-poor", "link-lost")  # fmt: skip
_STATES = tuple(name for name in COLOURS if name.startswith("state-"))

# What stands on what, and the contrast that it needs.
NEEDED: tuple[tuple[str, str, float], ...] = (
    *((word, "card", TEXT if word not in {"idle", "mission"} else MARK) for word in _WORDS),
    *((word, "page", TEXT) for word in ("ink", "soft", "focus", "danger", "warning")),
    *((word, "raised", TEXT) for word in ("ink", "soft")),
    *((state, "card", TEXT) for state in _STATES),
    *((f"on-{what}", what, TEXT) for what in ("critical", "high", "medium", "focus", "stop")),
    *((mode, "floor-0", MARK) for mode in ("idle", "mission", "teleoperation", "emergency")),
    *(("wall", f"floor-{i}", MARK) for i in range(len(tints.FLOORS))),
    *(("room-name", f"floor-{i}", TEXT) for i in range(len(tints.FLOORS))),
    *((f"pattern-{name}", "card", MARK) for name in PATTERNS),
    ("edge", "card", MARK),
    ("edge", "page", MARK),
    ("outline", "floor-0", TEXT),
)


def palettes() -> tuple[Palette, Palette]:
    """Return all colours, in light and in dark."""
    both = {**COLOURS, **_patterns()}
    return tuple({name: pair[i] for name, pair in both.items()} for i in (0, 1))  # type: ignore[return-value]


def _patterns() -> dict[str, tuple[str, str]]:
    looks = {name: look_of(name).colour.lower() for name in PATTERNS}
    return {f"pattern-{name}": _LINES[colour] for name, colour in looks.items()}


def hazard_marks() -> dict[str, dict[str, str]]:
    """Title and mark of each kind of hazard."""
    kinds = sorted(HAZARDS.items())
    return {kind: {"mark": look.mark, "colour": look.colour} for kind, look in kinds}


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colours, from 1 to 21 (WCAG 2.2, 1.4.3)."""
    dark, light = sorted((_luminance(one), _luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def _luminance(colour: str) -> float:
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def css() -> str:
    """Return the palette as custom properties; the system's theme holds until somebody chooses."""
    light, dark = (_properties(palette) for palette in palettes())
    return (
        "/* Written by dva_sim/console/pages/palette.py. */\n"
        f":root {{ color-scheme: light;\n{light}}}\n"
        "@media (prefers-color-scheme: dark) {\n"
        f":root:not([data-theme='light']) {{ color-scheme: dark;\n{dark}}}\n}}\n"
        f":root[data-theme='dark'] {{ color-scheme: dark;\n{dark}}}\n"
    )


def _properties(palette: Palette) -> str:
    return "".join(f"  --{name}: {colour};\n" for name, colour in palette.items())


def javascript() -> str:
    """Return the palette for canvases."""
    parts = dict(zip(("LIGHT", "DARK"), palettes(), strict=True)) | {"HAZARDS": hazard_marks()}
    head = "// Written by dva_sim/console/pages/palette.py.\n"
    return head + "".join(
        f"export const {name} = {json.dumps(value, indent=1)};\n" for name, value in parts.items()
    )


FILES = {"palette.css": css, "js/palette.js": javascript}


def write(folder: Path = STATIC) -> None:
    """Write both files."""
    for name, text in FILES.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text(), encoding="utf-8")


if __name__ == "__main__":
    write()
