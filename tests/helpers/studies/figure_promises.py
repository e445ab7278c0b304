"""Checks of report figures, on made-up results of every shape."""

from __future__ import annotations

import csv
import io
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from helpers.studies.made_up_results import SHAPES, Shape, make_up

from dva_sim.experiments.analysis.run_grid import Floats
from dva_sim.experiments.report.figures.palette import is_of_palette
from dva_sim.experiments.report.figures.style import (
    MIN_WORDS,
    NO_RESULT_LABEL,
    WIDTH,
    Drawn,
    ReportFigure,
    styled,
)
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.plugins import FAILURES
from dva_sim.testing.promises import Case, Outcome, broken_in, error_with_line, kept

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure


SLOW: Final = 5.0  # maximum CPU time of one figure [s]
_SCALES: Final = (1.0, 100.0, 1000.0, 0.01, 0.001)  # a drawing may be in % or ms
_NEAR: Final = 1e-6  # relative precision of numbers in a CSV

NEVER: Final = "is never drawn"
RAISES: Final = "raises"
EMPTY: Final = "does not say in one line what is missing where nothing was measured"
CHANGES: Final = "draws otherwise when it is drawn again"
NAME: Final = "gives a drawing of another name than its own"
UNEXPLAINED: Final = "does not say how it is read"
NUMBERS: Final = "draws a number that is not in its CSV"
SMALL: Final = "has words that are too small"
COLOUR: Final = "has a colour that is not the palette's"
OPEN: Final = "leaves a figure open"
TOUCHES: Final = "changes what it was given"


def check_figure(
    figure: type[ReportFigure], *, slow: float = SLOW, shapes: Mapping[str, Shape] = SHAPES
) -> Outcome:
    """See that a figure keeps what every figure promises, drawn twice of results of every shape.

    Args:
        figure: Class of the figure.
        slow: A figure that takes longer earns a warning [s].
        shapes: Shapes of the results, by name.

    Raises:
        BrokenPromises: it does not; a line for each promise.
    """
    took = list[float]()
    broken = broken_in(_every_shape(figure, shapes, took))
    if not took and not broken:
        needs = ", ".join((*figure.tables, *figure.columns))
        why = f"it applies to no results of any shape, although they have {needs}"
        broken = [f"{NEVER}: {why}"]
    slowest = max(took, default=0.0)
    warnings = [f"is slow: {slowest:.1f} s; should be {slow:g} s"] * (slowest > slow)
    return kept(broken, warnings, len(took), slowest)


def _every_shape(
    make: Callable[[], ReportFigure], shapes: Mapping[str, Shape], took: list[float]
) -> Iterator[Case]:
    figure = make()
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, shape) in enumerate(shapes.items()):
            reading = _reading(Path(folder) / str(number), shape, figure)
            for promise, case in _tried(make, reading, shape, took):
                yield promise, f"{case} ({name})"


def _reading(folder: Path, shape: Shape, figure: ReportFigure) -> Reading:
    """Results that cannot be written to."""
    reading = Reading(Results.load(make_up(folder, shape, figure.columns)))
    for name in reading.results.tables:
        for values in reading.table(name).values():
            values.flags.writeable = False
    return reading


def _tried(
    make: Callable[[], ReportFigure], reading: Reading, shape: Shape, took: list[float]
) -> Iterator[Case]:
    """Yield the faults of the figure of one study; the first one is drawn twice."""
    drawn: list[Drawn] = []
    for _ in range(1 if took else 2):
        try:
            one, problems = _drawn(make(), reading, took)
        except ConfigError as error:
            if shape.missing < 1 or "\n" in str(error):
                yield RAISES, error_with_line(error)
            return
        except FAILURES as error:
            is_read_only = "read-only" in str(error)
            promise = TOUCHES if is_read_only else EMPTY if shape.missing >= 1 else RAISES
            yield promise, error_with_line(error)
            return
        yield from problems
        if one is None:
            return
        drawn.append(one)
    first, again = drawn[0], drawn[-1]
    if (first.svg, first.png, first.csv) != (again.svg, again.png, again.csv):
        yield CHANGES, "other bytes"
    yield from _faults(first, make())


def _drawn(
    figure: ReportFigure, reading: Reading, took: list[float]
) -> tuple[Drawn | None, list[Case]]:
    """The drawing, if the figure applies, and what it left behind."""
    view = reading.view
    if view is None or not figure.applies(view, reading):
        return None, []
    before, start = _open(), time.process_time()
    with styled():
        drawn = figure.draw(view, reading)
    if drawn is not None:
        took.append(time.process_time() - start)
    left = [number for number in _open() if number not in before]
    problems = [(OPEN, f"pyplot's figure {left[0]}; draw in that of panels()")] if left else []
    _close(left)
    return drawn, problems


def _open() -> list[int]:
    """Numbers of the figures that pyplot holds, if anybody has imported it."""
    pyplot = sys.modules.get("matplotlib.pyplot")
    return list(pyplot.get_fignums()) if pyplot else []


def _close(numbers: list[int]) -> None:
    pyplot = sys.modules.get("matplotlib.pyplot")
    for number in numbers if pyplot else ():
        pyplot.close(number)  # type: ignore[union-attr]


# --- one drawing ---------------------------------------------------------------------------
def _faults(drawn: Drawn, figure: ReportFigure) -> Iterator[Case]:
    if drawn.name != figure.name:
        yield NAME, f"{drawn.name!r} for {figure.name!r}"
    if not drawn.title or not drawn.caption.rstrip().endswith((".", "!", "?")):
        yield UNEXPLAINED, f"title {drawn.title!r}, caption {drawn.caption!r}; should be sentences"
    if drawn.figure is None:
        yield UNEXPLAINED, "there is no figure in it; should be what finish() gives"
        return
    yield from _small_words(drawn.figure)
    yield from _other_colours(drawn.figure)
    yield from _unwritten(drawn.figure, _numbers(drawn.csv))


def _small_words(figure: Figure) -> Iterator[Case]:
    """Sizes as they are in the report's width."""
    from matplotlib.text import Text

    shrunk = min(1.0, WIDTH / figure.get_figwidth())
    for text in figure.findobj(Text):
        size = shrunk * float(text.get_fontsize())
        if text.get_text().strip() and text.get_visible() and size < MIN_WORDS - _NEAR:
            words = " ".join(text.get_text().split())
            yield SMALL, f"{words!r} in {size:.1f} pt; should be {MIN_WORDS:g} pt"
            return


def _other_colours(figure: Figure) -> Iterator[Case]:
    for artist in figure.findobj(lambda artist: not _is_aside(artist)):
        for colour in _colours_of(artist):
            if not is_of_palette(colour):
                kind = type(artist).__name__
                yield COLOUR, f"{colour} of a {kind}; those of looks() and palette can be used"
                return


def _colours_of(artist: Any) -> Iterator[str]:
    """Colours of all visible parts as `#rrggbb`, colour maps excepted."""
    from matplotlib.colors import to_hex, to_rgba_array

    if getattr(artist, "get_array", lambda: None)() is not None:
        return
    for name in _painted(artist):
        found = getattr(artist, f"get_{name}", lambda: None)()
        if found is None or (isinstance(found, str) and found in ("none", "auto", "inherit")):
            continue
        yield from (to_hex(rgba) for rgba in to_rgba_array(found) if rgba[3] > 0)


def _painted(artist: Any) -> list[str]:
    """Names of an artist's colour properties; a line may lack markers or the line itself."""
    from matplotlib.lines import Line2D

    if not isinstance(artist, Line2D):
        return ["color", "facecolor", "edgecolor"]
    has_marks = artist.get_marker() not in ("", "None", "none", " ", None)
    parts = (
        ["markerfacecolor", "markeredgecolor"] if has_marks and np.size(artist.get_xdata()) else []
    )
    return [*parts, *(["color"] if artist.get_linestyle() not in ("", "None", "none") else [])]


# --- numbers ---------------------------------------------------------------------------------
def _numbers(table: bytes) -> Floats:
    """Every number of a CSV, ascending, in all scales in which it may be drawn."""
    found = [0.0]
    for row in csv.reader(io.StringIO(table.decode())):
        for cell in row:
            try:
                found.append(float(cell))
            except ValueError:
                continue
    finite = np.array(found)[np.isfinite(found)]
    return np.unique(np.concatenate([scale * finite for scale in _SCALES]))


def _unwritten(figure: Figure, known: Floats) -> Iterator[Case]:
    """Values drawn along a numeric axis that the data lack; categories are skipped."""
    for axes in figure.axes:
        for artist, points in _points(axes):
            for which, axis, values in zip("xy", (axes.xaxis, axes.yaxis), points.T, strict=True):
                missing = _missing(values, known) if _has_scale(axis) else np.array([])
                if len(missing):
                    yield NUMBERS, f"{missing[0]:.6g} along {which} by a {artist}"
                    return


def _points(axes: Axes) -> Iterator[tuple[str, Floats]]:
    """Yield the points drawn in data coordinates, `(n, 2)` each."""
    for one in axes.lines:
        if one.get_transform() == axes.transData and not _is_aside(one):
            yield "line", np.asarray(one.get_xydata(), dtype=float)
    for many in axes.collections:
        if _is_aside(many):
            continue
        if many.get_offset_transform() == axes.transData:
            yield "mark", np.ma.filled(many.get_offsets(), np.nan).reshape(-1, 2).astype(float)
        elif hasattr(many, "get_segments") and many.get_transform() == axes.transData:
            there = [segment for segment in many.get_segments() if np.ndim(segment) == 2]
            yield "bar", np.concatenate([*there, np.empty((0, 2))])
    for bar in axes.containers:
        yield "bar", np.array([_end(patch) for patch in getattr(bar, "patches", ())]).reshape(-1, 2)


def _is_aside(artist: Any) -> bool:
    """True if the artist shows no result: hidden, or marked as site, scale or reference."""
    return not artist.get_visible() or artist.get_label() == NO_RESULT_LABEL


def _end(patch: Any) -> tuple[float, float]:
    """Length of a bar; nan across it, where the width has no meaning."""
    width, height = patch.get_width(), patch.get_height()
    return float(width), float(height)


def _has_scale(axis: Axis) -> bool:
    """True if positions on the axis are numbers rather than categories."""
    from matplotlib.category import StrCategoryLocator
    from matplotlib.ticker import FixedLocator, NullLocator

    return not isinstance(axis.get_major_locator(), FixedLocator | StrCategoryLocator | NullLocator)


def _missing(values: Floats, known: Floats) -> Floats:
    wanted = values[np.isfinite(values)]
    places = np.clip(np.searchsorted(known, wanted), 1, len(known) - 1) if len(known) > 1 else None
    if places is None:
        return np.asarray(wanted[wanted != known[0]])
    gaps = np.minimum(abs(wanted - known[places - 1]), abs(wanted - known[places]))
    return np.asarray(wanted[gaps > _NEAR * np.maximum(abs(wanted), 1e-9)])
