"""The figure of all evidence: predicted over measured values, with the band of each line."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from dva_sim.experiments.report.figures.palette import FAINT, INK, SOFT
from dva_sim.experiments.report.figures.style import Drawn, finish, log_axis, places, styled
from dva_sim.kernel.wording import capital
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.validation.evidence import SUBJECTS, Evidence, Verdict, judged

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARKS: Final[dict[Verdict, dict[str, Any]]] = {
    "holds": {"marker": "o", "ms": 3.5, "mfc": "white", "mec": INK, "mew": 0.7},
    "too rough": {"marker": "s", "ms": 3.5, "mfc": FAINT, "mec": SOFT, "mew": 0.7},
    "misses": {"marker": "X", "ms": 7, "mfc": INK, "mec": "white", "mew": 0.5},
}
_REACH: Final = 90.0  # percentile of the distances from 1 that sets the vertical axis
_MIN_HALF_AXIS: Final = 0.01  # shortest half of a vertical axis, as the logarithm of a ratio
_MOST: Final = math.log(3.0)  # longest half


class _Mark(NamedTuple):
    """Measured value of a line, and as ratios of it the prediction and the ends of the band."""

    measured: float
    predicted: float
    low: float
    high: float


def draw(lines: Sequence[Evidence]) -> Drawn:
    """Draw a panel for each subject that has lines with a verdict."""
    panels = {s: [e for e in judged(lines) if e.subject == s] for s in SUBJECTS}
    panels = {subject: own for subject, own in panels.items() if own}
    with styled():
        figure, _, axes = places(max(1, len(panels)), 1 if len(panels) < 2 else 2, 3.4)
        for ax, (subject, own) in zip(axes, panels.items(), strict=False):
            held = sum(line.verdict == "holds" for line in own)
            ax.set_title(f"{capital(subject)}: {held} of {len(own)} lines hold")
            _draw_panel(ax, own)
        for verdict, look in _MARKS.items():
            axes[0].plot([], [], ls="", label=verdict, **look)
        axes[0].plot([], [], color=FAINT, lw=3, label="band")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=4)
        return captioned(figure, "evidence")


def captioned(figure: Figure, name: str) -> Drawn:
    """Return a figure with its title and caption, which are in `templates/captions.yaml`."""
    words = load_yaml(Path(__file__).parent / "templates/captions.yaml").data[name]
    return finish(figure, name, words["title"], words["text"])


def _draw_panel(axes: Axes, lines: Sequence[Evidence]) -> None:
    marks = {v: [m for e in lines if e.verdict == v and (m := ratios(e))] for v in _MARKS}
    every = np.array([mark for own in marks.values() for mark in own])
    if not len(every):
        return
    distance = float(np.percentile(np.abs(np.log(every[:, 1:])), _REACH))
    reach = min(max(1.15 * distance, _MIN_HALF_AXIS), _MOST)
    low = math.exp(-reach)
    high = math.exp(reach)
    at, _, *ends = every.T
    axes.vlines(at, *np.clip(ends, low, high), color=FAINT, lw=2.5, zorder=1)
    axes.axhline(1.0, color=SOFT, lw=0.7, zorder=2)
    for verdict, own in marks.items():
        for marker, least, most in (("v", 0, low), (None, low, high), ("^", high, math.inf)):
            points = [(m.measured, m.predicted) for m in own if least < m.predicted <= most]
            if points:  # no bounding box of nothing
                x, y = np.transpose(points)
                look = _MARKS[verdict] | ({"marker": marker} if marker else {})
                axes.plot(x, np.clip(y, low, high), ls="", clip_on=False, zorder=3, **look)
    axes.set(
        xlabel="measured, in the unit of the line", ylabel="predicted / measured", ylim=(low, high)
    )
    log_axis(axes, "x")


def ratios(line: Evidence) -> _Mark | None:
    """Return the line as ratios; None if it has no place on a logarithmic axis."""
    low = line.low
    high = line.high
    at = line.measured
    if at is None and low is not None and high is not None:
        at = 0.5 * (low + high)
    predicted = line.predicted
    if at is None or predicted is None or not 0 < at < math.inf or not 0 < predicted < math.inf:
        return None
    ratio = predicted / at
    if low is None or high is None:
        return _Mark(at, ratio, ratio, ratio)
    ends = (
        (predicted / high, predicted / max(low, 1e-9))
        if line.holds_measured
        else (low / at, high / at)
    )
    return _Mark(at, ratio, *(max(end, 1e-9) for end in ends))
