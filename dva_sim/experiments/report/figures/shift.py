"""The figures of a study of dispatch."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor
from dva_sim.experiments.analysis.shift_effects import BEST, FLOOR, Shifts
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures.csv_numbers import Numbers, with_limits
from dva_sim.experiments.report.figures.legend import key
from dva_sim.experiments.report.figures.palette import FAINT, INK, SOFT, Look, looks
from dva_sim.experiments.report.figures.style import Drawn, ReportFigure, panels
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.report.shift_page import ShiftPage
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.wording import capital

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dva_sim.experiments.report.summary import Reading


class ShiftFigure(ReportFigure):
    """Figure that compares policies on shifts."""

    pages = ("shift",)

    def draw(self, view: StudyView, reading: Reading) -> Drawn | None:
        """Draw it, from the shifts."""
        page = reading.page
        return self.drawn(page.shifts) if isinstance(page, ShiftPage) else None

    @abstractmethod
    def drawn(self, shifts: Shifts) -> Drawn | None:
        """Return the figure; None if it would be empty."""


def _looks(shifts: Shifts) -> dict[Level, Look]:
    """Return the style of each policy, the same in every figure."""
    return looks(Factor("dispatch.policy", shifts.policies))


# --- the trade -----------------------------------------------------------------------------
class Trade(ShiftFigure):
    name = "trade"
    title = "The trade: how soon somebody is there, against how long people stand in danger"

    def drawn(self, shifts: Shifts) -> Drawn | None:
        """Draw the figure."""
        if not shifts.can_spare:
            return None
        label = "Exposure of people in finding out what it is [s per event]"
        figure = _scatter(shifts, "exposure_look_s", label)
        act = shifts.means("exposure_s") - shifts.means("exposure_look_s")
        words = caption(
            "trade",
            follow=f"{shifts.follow:g}",
            baseline=shifts.baseline,
            act=f"{float(np.nanmedian(act)):.0f}",
        )
        return self.finish(figure, words, _scatter_numbers(shifts, "exposure_look_s"))


def _scatter(shifts: Shifts, column: str, label: str) -> Figure:
    """Return the response over another measure, both better where smaller."""
    across = shifts.means(column)
    response = shifts.means("response_mean_s")
    figure, (axes,) = panels(1, len(shifts.stops), 4.0)
    look = _looks(shifts)
    halves = [_half_widths(shifts, c) for c in (column, "response_mean_s")]
    for stop, ax in enumerate(axes):
        for number, policy in enumerate(shifts.policies):
            colour, mark = look[policy]
            ax.errorbar(
                across[number, stop],
                response[number, stop],
                xerr=halves[0][number, stop],
                yerr=halves[1][number, stop],
                color=colour,
                marker=mark,
                ms=9 if mark == "*" else 6,
                ls="",
                lw=1,
                label=policy,
            )
        _frontier(ax, across[:, stop], response[:, stop])
        ax.set_title(capital(shifts.titles[stop]))
        ax.grid(True, axis="both")
        ax.margins(0.1)
    axes[0].set_ylabel("Restricted mean time to response [s]")
    axes[len(axes) // 2].set_xlabel(label)
    key(figure, *axes[0].get_legend_handles_labels())
    return figure


def _scatter_numbers(shifts: Shifts, column: str) -> Numbers:
    """Return means, and ends of bars: the interval of the difference against the baseline."""
    numbers = Numbers()
    columns = dict[str, Any]()
    for name in ("response_mean_s", column):
        means = shifts.means(name)
        half = _half_widths(shifts, name)
        columns |= with_limits(name, means, means - half, means + half)
    for stop, title in enumerate(shifts.titles):
        at_stop: dict[str, Any] = {name: values[:, stop] for name, values in columns.items()}
        numbers.add({"at": title}, at_stop | {"dispatch.policy": shifts.policies})
    return numbers


def _half_widths(shifts: Shifts, column: str) -> Any:
    bands = shifts.against(column, shifts.baseline)
    half = 0.5 * (bands.high - bands.low).reshape(len(shifts.policies), -1)
    return np.nan_to_num(half)


def _frontier(ax: Axes, x: Any, y: Any) -> None:
    """Draw a line through the policies that no other beats in both measures."""
    best = [
        i
        for i in range(len(x))
        if not any(
            x[j] <= x[i] and y[j] <= y[i] and (x[j] < x[i] or y[j] < y[i]) for j in range(len(x))
        )
    ]
    best.sort(key=lambda i: x[i])
    ax.plot(x[best], y[best], color=FAINT, lw=5, zorder=0, solid_capstyle="round")


# --- one line per policy ---------------------------------------------------------------------
class WayToBest(ShiftFigure):
    name = "way"
    title = "How much of what can be gained in response each policy gains"

    def drawn(self, shifts: Shifts) -> Drawn | None:
        """Draw the figure."""
        if shifts.target is None or not shifts.travellers:
            return None
        names = shifts.travellers
        numbers = Numbers()
        look = _looks(shifts)
        figure, (axes,) = panels(1, len(shifts.stops), 1.1 + 0.26 * len(names), sharey=True)
        for stop, ax in enumerate(axes):
            bands = shifts.progress(stop)
            columns = with_limits("share", bands.mean, bands.low, bands.high)
            numbers.add({"at": shifts.titles[stop]}, columns | {"dispatch.policy": names})
            for row, policy in enumerate(names):
                colour, mark = look[policy]
                ax.hlines(row, 100 * bands.low[row], 100 * bands.high[row], color=colour, lw=1.6)
                ax.plot(100 * bands.mean[row], row, marker=mark, color=colour, ms=7)
            ax.axvline(100, color=INK, lw=0.8)
            ax.axvline(0, color=SOFT, lw=0.8, ls=":")
            _policy_axis(ax, names, capital(shifts.titles[stop]))
        target = "the oracle" if shifts.target == BEST else "a fresh unit at every base"
        axes[len(axes) // 2].set_xlabel(f"Share of the way from {FLOOR} to {target} [%]")
        is_oracle = shifts.target == BEST
        beats = np.zeros(1) if is_oracle else 100 * shifts.means("beats_bound_share")
        words = caption(
            "way",
            is_oracle=is_oracle,
            target="oracle" if is_oracle else "bound",
            low=f"{np.nanmin(beats):.0f}",
            high=f"{np.nanmax(beats):.0f}",
        )
        title = f"{self.title}: 0 is {FLOOR}, 100 {target}"
        return self.finish(figure, words, numbers, title=title)


def _policy_axis(ax: Axes, names: tuple[str, ...], title: str) -> None:
    """Draw a row for each policy, the first on top."""
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.grid(True, axis="both")
    ax.set_title(title)
