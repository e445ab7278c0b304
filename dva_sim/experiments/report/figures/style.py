"""Common style of all figures, and their base class `ReportFigure`; drawn as stable bytes.

The numbers behind a figure are written down as they are drawn, to be kept beside it as CSV.
"""

from __future__ import annotations

import io
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor, Setting
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures.csv_numbers import Numbers
from dva_sim.experiments.report.figures.palette import FAINT, INK, SOFT
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import capital
from dva_sim.simulation.labels import brief, factor_name, level_name, measure_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dva_sim.experiments.report.summary import Reading


_TITLE = 78  # characters of a title that the width holds
_CROWDED = 45  # characters of ticks that fit beside each other in the width
_DECADES = 5e3  # of the ends of a logarithmic axis, from which on 2 and 5 have no room
_MIN_TICK = 8  # characters of a tick's name in a line
_MAX_UPRIGHT = 7  # names of levels side by side; more are turned
_ROW_LABEL = 28  # characters that the height of a row holds
NO_RESULT_LABEL = "_aside"  # label of what is drawn but is no result: the site, a scale, a heading
MIN_WORDS = 6.0  # [pt] in this width
WIDTH = 8.4  # [in]; on screen and on paper it is stretched or shrunk to the column

_STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelcolor": INK,
    "axes.edgecolor": SOFT,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.axisbelow": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "hatch.linewidth": 0.5,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "text.color": INK,
    "lines.linewidth": 1.8,
    "legend.frameon": False,
    "svg.hashsalt": "dva-sim",
    "svg.fonttype": "path",
}


@dataclass(frozen=True)
class Drawn:
    """A finished figure.

    Attributes:
        name: Its file name without an ending.
        title: Title above the figure.
        caption: Explanation of how to read it.
        reads: Further reading notes, in sentences that several figures share.
        svg: The figure as vectors.
        png: The figure as pixels.
        csv: The numbers behind it; empty where none were written down.
        figure: The figure itself, laid out, to be put on a page.
    """

    name: str
    title: str
    caption: str
    svg: bytes
    png: bytes
    csv: bytes = b""
    figure: Figure | None = field(default=None, compare=False, repr=False)
    reads: tuple[str, ...] = ()


@contextmanager
def styled() -> Iterator[None]:
    """Apply the look of the report for as long as the block lasts."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)  # type: ignore[arg-type]
        yield


def panels(
    rows: int, columns: int, height: float, **options: Any
) -> tuple[Figure, list[list[Axes]]]:
    """Return a grid of axes in the report's width; `height` per row [in]."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height * rows), dpi=150, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    return figure, [list(row) for row in axes]


def places(
    count: int, abreast: int, height: float, **options: Any
) -> tuple[Figure, list[list[Axes]], list[Axes]]:
    """Return axes for `count` panels, `abreast` in a row: figure, grid, and visible panels."""
    figure, grid = panels(-(-count // abreast), abreast, height, **options)
    flat = [ax for row in grid for ax in row]
    for ax in flat[count:]:
        ax.set_visible(False)
    return figure, grid, flat[:count]


def lying(axes: Axes) -> None:
    """Let values run along x, so that is where lines of the grid help."""
    axes.grid(axis="x", visible=True)
    axes.grid(axis="y", visible=False)


def finish(
    figure: Figure,
    name: str,
    title: str,
    caption: str,
    numbers: Numbers | None = None,
    reads: Sequence[str] = (),
) -> Drawn:
    """Render once to SVG and once to PNG, with nothing in them that changes from day to day."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    _name_logarithmic(figure)
    layout = figure.get_layout_engine()
    if layout is not None:
        layout.execute(figure)
    figure.set_layout_engine("none")  # both files get one and the same layout
    png = io.BytesIO()
    svg = io.BytesIO()
    # The canvases themselves, since savefig would draw each figure twice; the PNG first,
    # because the SVG leaves the figure at its own resolution.
    metadata: dict[str, str | None] = {"Software": None}
    FigureCanvasAgg(figure).print_png(png, metadata=metadata)  # type: ignore[no-untyped-call]
    metadata = {"Date": None, "Creator": None}
    FigureCanvasSVG(figure).print_svg(svg, metadata=metadata)  # type: ignore[no-untyped-call]
    table = numbers.csv() if numbers else b""
    notes = tuple(filter(None, reads))
    return Drawn(
        name=name,
        title=title,
        caption=caption,
        svg=svg.getvalue(),
        png=png.getvalue(),
        csv=table,
        figure=figure,
        reads=notes,
    )


def _name_logarithmic(figure: Figure) -> None:
    """Say of each logarithmic axis that it is one."""
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            label = axis.get_label_text()
            if label and axis.get_scale() in ("log", "symlog") and "log scale" not in label:
                gap = "\n" if axis is ax.yaxis else " "
                axis.set_label_text(f"{label},{gap}log scale")


def axis_label(name: str, text: str | None = None) -> str:
    """Return a measure or factor with its unit in brackets."""
    unit = unit_of(name)
    words = capital(text or measure_name(name))
    return f"{words} [{unit}]" if unit else words


def wrapped(text: str, width: int = 38) -> str:
    """Return the text in lines of at most `width` characters."""
    return "\n".join(textwrap.wrap(text, width))


def stops_axis(axes: Axes, over: Factor | None) -> None:
    """Draw the factor along x, level beside level: 0 to 1 s are all readable."""
    if over is None:
        axes.set_xticks([])
        axes.set_xlim(-0.5, 0.5)
        return
    names, unit = tick_names(over)
    narrow = max(_MIN_TICK, _TITLE // len(names))
    if over.is_numeric or len(names) <= _MAX_UPRIGHT:
        axes.set_xticks(range(len(names)), [wrapped(name, narrow) for name in names])
    else:
        axes.set_xticks(range(len(names)), names, rotation=30, ha="right", rotation_mode="anchor")
    axes.set_xlabel(_factor_label(over, unit))
    axes.set_xlim(-0.5, len(names) - 0.5)
    if not over.is_numeric:
        for stop in range(1, len(names)):  # words are apart: nothing leads from one to the next
            axes.axvline(stop - 0.5, color=FAINT, lw=0.8, zorder=0)


def level_axis(axes: Axes, factor: Factor, width: int = _ROW_LABEL) -> None:
    """Draw a factor along y, level above level, names in lines of at most `width` characters."""
    names, unit = tick_names(factor)
    axes.set_yticks(range(len(names)), [wrapped(name, width) for name in names])
    axes.set_ylabel(_factor_label(factor, unit))
    axes.set_ylim(-0.5, len(names) - 0.5)


def _factor_label(factor: Factor, unit: str) -> str:
    """Return the label with its unit, and True if levels are spaced by their values."""
    scale = "" if is_to_scale(factor) else ", not to scale"
    return f"{capital(factor_name(factor.name))}{f' [{unit}]' if unit else ''}{scale}"


def is_to_scale(factor: Factor) -> bool:
    """Return True if the levels are equally spaced; always true of words."""
    if not factor.is_numeric:
        return True
    steps = np.diff([float(v) for v in factor.levels if isinstance(v, int | float)])
    return bool(np.allclose(steps, steps[:1])) if len(steps) else True


def tick_names(over: Factor) -> tuple[list[str], str]:
    """Return the short names of the levels and the unit they have in common.

    Below 1 s in milliseconds.
    """
    values = [v for v in over.levels if isinstance(v, int | float)]
    unit = unit_of(over.name)
    if not over.is_numeric or not unit:
        return [level_name(over.name, level, short=True) for level in over.levels], ""
    if unit == "s" and max(values) <= 5 and any(0 < v < 1 for v in values):
        return [f"{1000 * v:g}" for v in values], "ms"
    return [f"{v:g}" for v in values], unit


def log_axis(axes: Axes, which: Literal["x", "y"] = "y") -> None:
    """Make an axis logarithmic, with plain numbers at round places and no others."""
    from matplotlib.ticker import LogLocator, NullLocator

    axis = axes.xaxis if which == "x" else axes.yaxis
    axes.set(**{f"{which}scale": "log"})
    low, high = axis.get_view_interval()
    ratio = high / low
    subs = (1,) if ratio > _DECADES else (1, 2, 5) if ratio > 5 else range(1, 10)
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def hatch_stops(axes: Axes, stops: Sequence[int]) -> None:
    """Mark stops that are extrapolations."""
    for stop in stops:
        axes.axvspan(
            stop - 0.5, stop + 0.5, facecolor="none", edgecolor=FAINT, hatch="///", lw=0, zorder=0
        )


def hatch_words(view: StudyView) -> str:
    """Return the caption of the hatching; empty if no panel has any."""
    if not any(view.stops_outside(panel) for panel in view.shown):
        return ""
    return "Hatched: at least one line is extrapolated there (marked † in the tables)."


def panel_grid(view: StudyView, height: float) -> tuple[Figure, list[Axes]]:
    """Return axes for each setting shown, up to three abreast, four as two by two.

    `height` each [in].
    """
    count = len(view.shown)
    columns = 2 if count == 4 else count
    rows = count // columns
    options = {"sharex": True, "sharey": True}
    figure, axes = panels(rows, columns, height if rows == 1 else 0.85 * height, **options)
    return figure, [ax for row in axes for ax in row]


def label_panels(axes: Sequence[Axes], view: StudyView, text: str) -> None:
    """Label a grid of panels, with common labels only on its outer edges."""
    columns = 2 if len(axes) == 4 else len(axes)
    for index, (ax, panel) in enumerate(zip(axes, view.shown, strict=True)):
        panel_title(ax, panel, _TITLE // columns)
        stops_axis(ax, view.over)
        _make_room(ax, columns)
        ax.set_ylabel(text if index % columns == 0 else "")
        if index < len(axes) - columns:
            ax.set_xlabel("")


def panel_title(axes: Axes, panel: Setting, width: int = 90) -> None:
    """Say which levels a panel shows, in lines of `width`; nothing if there is but one panel."""
    axes.set_title(wrapped(panel_name(panel), width))


def panel_name(panel: Setting) -> str:
    """Return `250 ms, latest-wins`; nothing if there is but one panel."""
    return capital(brief(panel))


def _make_room(axes: Axes, columns: int) -> None:
    """Wrap or shrink the tick labels so that panels side by side do not overlap."""
    axes.set_xlabel(wrapped(axes.get_xlabel(), _TITLE // columns))
    names = [label.get_text() for label in axes.get_xticklabels()]
    if columns * sum(map(len, names)) > _CROWDED:
        narrow = max(_MIN_TICK, _TITLE // (columns * len(names)))
        words = [wrapped(name.replace("\n", " "), narrow) for name in names]
        axes.set_xticks(axes.get_xticks(), words, fontsize=7)


def has_lines(view: StudyView) -> bool:
    """Return lines lead from number to number, if all steps are equal.

    Else their slope means nothing.
    """
    return leads_on(view) and view.over is not None and is_to_scale(view.over)


def leads_on(view: StudyView) -> bool:
    """Return True if the stops are numeric, so that a line may join them."""
    return view.over is not None and view.over.is_numeric and len(view.stops) > 1


def dodge(lines: tuple[Level, ...]) -> list[tuple[Level, float]]:
    """Return each line's place beside its stop, so that the marks of a stop stand in a row."""
    width = 0.8 / len(lines)
    return [(level, (i - (len(lines) - 1) / 2) * width) for i, level in enumerate(lines)]


def stop_of(view: StudyView, stop: Level) -> Setting:
    """Return the level along x that a stop stands for, by its factor."""
    return {view.over.name: stop} if view.over else {}


def place_of(over: Factor, value: float) -> float | None:
    """Return the position of a value among evenly spaced levels; None if outside."""
    levels = np.array([float(v) for v in over.levels if isinstance(v, int | float)])
    if not over.is_numeric or len(levels) < 2 or not levels[0] <= value <= levels[-1]:
        return None
    return float(np.interp(value, levels, np.arange(len(levels))))


class ReportFigure(ABC):
    """A figure is drawn wherever its tables and columns are there, in the look of the report.

    `dva-sim check figure mine.py:Mine` tries what all figures promise: the same results give the
    same bytes; every number that is drawn stands in the CSV beside the figure; words are legible,
    colours are the palette's; what was not measured is left out and makes no error; nothing stays
    open and nothing is changed.

    Attributes:
        name: Base name of its files: lower-case letters, digits and underscores.
        title: Title in one line; a drawing may have a more specific title.
        tables: Tables that the results must hold.
        columns: Columns of the table `runs` of which some run of the answer's part must have a
            number.
        pages: Kinds of reports that it belongs to, `driving`, `shift` or `transport`; all of them
            where none is named.
        has_panels: True if it has a panel for each setting of the factors that are neither lines
            nor along x; the report then names these factors.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    tables: ClassVar[tuple[str, ...]] = ("runs",)
    columns: ClassVar[tuple[str, ...]] = ()
    pages: ClassVar[tuple[str, ...]] = ()
    has_panels: ClassVar[bool] = False

    def applies(self, view: StudyView, reading: Reading) -> bool:
        """Return True if the results have the page, tables and columns that the figure needs."""
        if self.pages and reading.page.name not in self.pages:
            return False
        return all(map(reading.table, self.tables)) and all(map(view.part.has, self.columns))

    @abstractmethod
    def draw(self, view: StudyView, reading: Reading) -> Drawn | None:
        """Draw it.

        Args:
            view: The part that the answer speaks of: its lines, what runs along x, its panels.
            reading: All else that the results hold: `reading.table("events")`, `reading.finding`,
                `reading.scenario_of(part)`.

        Returns:
            What `finish` gives; None where there is nothing to be seen.
        """

    def finish(
        self,
        figure: Figure,
        caption: str,
        numbers: Numbers,
        *,
        title: str = "",
        reads: Sequence[str] = (),
    ) -> Drawn:
        """Return the finished figure, as vectors and pixels, with nothing that changes day by day.

        Args:
            figure: Figure made by `panels`.
            caption: Explanation of how to read it.
            numbers: Numbers drawn, for the CSV file.
            title: More specific title than the figure's own, if any.
            reads: Further reading notes, in sentences that several figures share.
        """
        return finish(figure, self.name, title or self.title, caption, numbers=numbers, reads=reads)
