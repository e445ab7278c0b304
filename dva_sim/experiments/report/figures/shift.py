"""The figures of a study of dispatch."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor
from dva_sim.experiments.analysis.shift_effects import BEST, FLOOR, Shifts, pooled
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures.csv_numbers import Numbers, with_limits
from dva_sim.experiments.report.figures.endings import shares_of, stack_in_time
from dva_sim.experiments.report.figures.legend import box, key
from dva_sim.experiments.report.figures.palette import FAINT, FATES, INK, PAPER, SOFT, Look, looks
from dva_sim.experiments.report.figures.style import Drawn, ReportFigure, panels
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.report.shift_page import ShiftPage
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.wording import capital
from dva_sim.simulation.timed.shift_measures import FATES as ENDS
from dva_sim.simulation.timed.shift_measures import FEWEST_IN_ZONE, fates

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dva_sim.experiments.report.summary import Reading


_FATES = ("confirmed", "refuted", "open", "expired", "escalated")  # as they are stacked
_NAMES = {"refuted": "cleared as a false alarm", "open": "still open"}
FILLS = {fate: FATES["cleared" if fate == "refuted" else fate] for fate in _FATES}
_QUANTILES = (0.5, 0.9, 0.95)


class ShiftFigure(ReportFigure):
    """Figure that compares policies on shifts."""

    pages = ("shift",)

    def draw(self, view: StudyView, reading: Reading) -> Drawn | None:
        """Draw it, from the shifts."""
        page = reading.page
        return self.drawn(page.shifts) if isinstance(page, ShiftPage) else None

    @abstractmethod
    def drawn(self, shifts: Shifts) -> Drawn | None:
        """The figure; None where there is nothing to be seen."""


def _looks(shifts: Shifts) -> dict[Level, Look]:
    """Return the style of each policy, the same in every figure."""
    return looks(Factor("dispatch.policy", shifts.policies))


# --- the trade -----------------------------------------------------------------------------
class Trade(ShiftFigure):
    name = "trade"
    title = "The trade: how soon somebody is there, against how long people stand in danger"

    def drawn(self, shifts: Shifts) -> Drawn | None:
        """Draw it."""
        if not shifts.can_spare:
            return None
        label = "Exposure of people in finding out what it is [s per event]"
        figure = _scatter(shifts, "exposure_look_s", label)
        words = caption("trade", **_facts(shifts), act=f"{_act(shifts):.0f}")
        return self.finish(figure, words, _scatter_numbers(shifts, "exposure_look_s"))


class Stages(ShiftFigure):
    name = "stages"
    title = "Looking first or containing first: response against containment"
    columns = ("containment_mean_s",)

    def drawn(self, shifts: Shifts) -> Drawn | None:
        """Draw it."""
        figure = _scatter(shifts, "containment_mean_s", "Restricted mean time to containment [s]")
        numbers = _scatter_numbers(shifts, "containment_mean_s")
        return self.finish(figure, caption("stages", **_facts(shifts)), numbers)


def _facts(shifts: Shifts) -> dict[str, str]:
    return {"follow": f"{shifts.follow:g}", "baseline": shifts.baseline}


def _scatter(shifts: Shifts, column: str, label: str) -> Figure:
    """Response over another measure, both better where smaller."""
    across, response = shifts.means(column), shifts.means("response_mean_s")
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
    _key(figure, axes[0])
    return figure


def _scatter_numbers(shifts: Shifts, column: str) -> Numbers:
    """Means, and ends of bars: the interval of the difference against the baseline."""
    numbers, columns = Numbers(), dict[str, Any]()
    for name in ("response_mean_s", column):
        means, half = shifts.means(name), _half_widths(shifts, name)
        columns |= with_limits(name, means, means - half, means + half)
    for stop, title in enumerate(shifts.titles):
        at_stop: dict[str, Any] = {name: values[:, stop] for name, values in columns.items()}
        numbers.add({"at": title}, at_stop | {"dispatch.policy": shifts.policies})
    return numbers


def _act(shifts: Shifts) -> float:
    """Median extra exposure of containing an event, over all cells [s per event]."""
    return float(np.nanmedian(shifts.means("exposure_s") - shifts.means("exposure_look_s")))


def _half_widths(shifts: Shifts, column: str) -> Any:
    found = shifts.against(column, shifts.baseline)
    half = 0.5 * (found.high - found.low).reshape(len(shifts.policies), -1)
    return np.nan_to_num(half)


def _frontier(ax: Axes, x: Any, y: Any) -> None:
    """A line through those that no other beats on both."""
    best = [
        i
        for i in range(len(x))
        if not any(
            x[j] <= x[i] and y[j] <= y[i] and (x[j] < x[i] or y[j] < y[i]) for j in range(len(x))
        )
    ]
    best.sort(key=lambda i: x[i])
    ax.plot(x[best], y[best], color=FAINT, lw=5, zorder=0, solid_capstyle="round")


# --- what becomes of them --------------------------------------------------------------------
class FatesOfEvents(ShiftFigure):
    name = "fates"
    title = "What becomes of events, and when"
    tables = ("runs", "events")

    def drawn(self, shifts: Shifts) -> Drawn | None:
        """Draw it."""
        if not shifts.events:
            return None
        chosen = chosen_policies(shifts)
        figure, axes = panels(len(shifts.stops), len(chosen), 2.0, sharex=True, sharey=True)
        times, numbers = np.linspace(0.0, shifts.follow, 301), Numbers()
        for stop, row in enumerate(axes):
            for policy, ax in zip(chosen, row, strict=True):
                events = dict(shifts.events_of(policy, stop))
                if len(events["event_id"]):
                    shares = shares_of(fates(events), ENDS, "open", times)
                    stack_in_time(ax, {fate: shares[fate] for fate in _FATES}, times, FILLS)
                    where = {"at": shifts.titles[stop], "dispatch.policy": policy}
                    numbers.add(where, {"t_s": times} | shares)
                ax.set_xlim(0, shifts.follow)
                ax.set_ylim(0, 1)
                ax.grid(False)
                if stop == 0:
                    ax.set_title(policy)
            row[0].set_ylabel(f"{capital(shifts.titles[stop])}\nshare of events")
        for ax in axes[-1]:
            ax.set_xlabel("Time since the report [s]")
        key(figure, [box(FILLS[fate]) for fate in _FATES], [_NAMES.get(f, f) for f in _FATES])
        return self.finish(figure, caption("fates", follow=f"{shifts.follow:g}"), numbers)


def chosen_policies(shifts: Shifts) -> list[str]:
    """The floor, the two of the contrast, and the quickest at the highest load; four at most."""
    response = shifts.means("response_mean_s")[:, -1]
    quickest = [shifts.policies[i] for i in np.argsort(response, kind="stable")]
    wanted = [FLOOR, *reversed([str(c) for c in shifts.view.contrast or ()]), *quickest]
    return list(dict.fromkeys(p for p in wanted if p in shifts.policies))[:4]


# --- one line per policy ---------------------------------------------------------------------
class WayToBest(ShiftFigure):
    name = "way"
    title = "How much of what can be gained in response each policy gains"

    def drawn(self, shifts: Shifts) -> Drawn | None:
        """Draw it."""
        if shifts.target is None or not shifts.travellers:
            return None
        names, numbers, look = shifts.travellers, Numbers(), _looks(shifts)
        figure, (axes,) = panels(1, len(shifts.stops), _height(len(names)), sharey=True)
        for stop, ax in enumerate(axes):
            found = shifts.progress(stop)
            columns = with_limits("share", found.mean, found.low, found.high)
            numbers.add({"at": shifts.titles[stop]}, columns | {"dispatch.policy": names})
            for row, policy in enumerate(names):
                colour, mark = look[policy]
                ax.hlines(row, 100 * found.low[row], 100 * found.high[row], color=colour, lw=1.6)
                ax.plot(100 * found.mean[row], row, marker=mark, color=colour, ms=7)
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


class Percentiles(ShiftFigure):
    name = "percentiles"
    title = "Percentiles of the time to response"
    tables = ("runs", "events")

    def drawn(self, shifts: Shifts) -> Drawn | None:
        """Draw it."""
        if not shifts.events:
            return None
        names, numbers, look = shifts.policies, Numbers(), _looks(shifts)
        figure, (axes,) = panels(1, len(shifts.stops), _height(len(names)), sharey=True)
        missing = False
        for stop, ax in enumerate(axes):
            for row, policy in enumerate(names):
                colour = look[policy].colour
                value, low, high = pooled(shifts.events_of(policy, stop), _QUANTILES, shifts.follow)
                where = {"at": shifts.titles[stop], "dispatch.policy": policy}
                columns = with_limits("response_s", value, low, high)
                shown = {"quantile": _QUANTILES, "drawn_until_s": [shifts.follow] * len(_QUANTILES)}
                numbers.add(where, columns | shown)
                inside = [np.minimum(x, shifts.follow) for x in (value, low, high)]
                ax.hlines([row] * 3, inside[1], inside[2], color=colour, lw=5, alpha=0.3)
                ax.plot(inside[0], [row] * 3, color=colour, lw=0.8)
                for x, reached, fill in zip(
                    inside[0], np.isfinite(value), (True, False, False), strict=True
                ):
                    mark = "o" if reached else ">"
                    ax.plot(x, row, mark, ms=6, mfc=colour if fill else PAPER, mec=colour)
                missing |= not np.isfinite(high).all()
            _policy_axis(ax, names, capital(shifts.titles[stop]))
            ax.set_xlim(0, None)
        axes[len(axes) // 2].set_xlabel(
            "Time to response by 50 % (filled), 90 % and 95 % of all events [s]"
        )
        words = caption("percentiles", follow=f"{shifts.follow:g}", missing=missing)
        return self.finish(figure, words, numbers)


class Burden(ShiftFigure):
    name = "burden"
    title = "How busy people are, and how evenly work and service are spread"

    def drawn(self, shifts: Shifts) -> Drawn | None:
        """Draw it."""
        columns = {
            "use_of_guards": "Use of guards",
            "use_of_operators": "Use of operators",
            "evenness_of_guards": "Evenness among guards",
            "zone_ratio": "Worst zone's response\nover the best one's",
        }
        there = {c: text for c, text in columns.items() if shifts.view.part.has(c)}
        names, numbers, look = shifts.policies, Numbers(), _looks(shifts)
        figure, (axes,) = panels(1, len(there), _height(len(names)), sharey=True)
        for stop, title in enumerate(shifts.titles):
            values: dict[str, Any] = {column: shifts.means(column)[:, stop] for column in there}
            numbers.add({"at": title}, values | {"dispatch.policy": names})
        shades = np.linspace(0.35, 1.0, len(shifts.stops))
        for ax, (column, text) in zip(axes, there.items(), strict=True):
            means = shifts.means(column)
            for row, policy in enumerate(names):
                for stop in shifts.stops:
                    ax.plot(
                        means[row, stop],
                        row,
                        "o",
                        ms=4 + 2 * stop,
                        color=look[policy].colour,
                        alpha=float(shades[stop]),
                        mec=PAPER,
                    )
            _policy_axis(ax, names, text)
            if column.startswith("use"):
                ax.set_xlim(0, 1.02)
        fewest = FEWEST_IN_ZONE
        words = caption("burden", loads=", ".join(shifts.titles), fewest=fewest)
        return self.finish(figure, words, numbers)


def _height(rows: int) -> float:
    return 1.1 + 0.26 * rows


def _policy_axis(ax: Axes, names: tuple[str, ...], title: str) -> None:
    """A row for each policy, the first on top."""
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.grid(True, axis="both")
    ax.set_title(title)


def _key(figure: Any, ax: Axes) -> None:
    handles, names = ax.get_legend_handles_labels()
    key(figure, handles, names)
