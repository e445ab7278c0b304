"""The figures of a study of dispatch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.analysis.paired_effects import Factor
from dva_sim.experiments.analysis.shift_effects import BEST, FLOOR, Shifts, pooled
from dva_sim.experiments.report.figures.palette import (
    FAINT,
    FATES,
    INK,
    PAPER,
    SOFT,
    Look,
    box,
    key,
    looks,
)
from dva_sim.experiments.report.figures.style import (
    Drawn,
    Numbers,
    finish,
    panels,
    styled,
    with_unit,
)
from dva_sim.experiments.study.labels import capital
from dva_sim.experiments.study.schema import Level
from dva_sim.simulation.shift import measures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_FATES = ("confirmed", "refuted", "open", "expired", "escalated")  # as they are stacked
_NAMES = {"refuted": "cleared as a false alarm", "open": "still open"}
_QUANTILES = (0.5, 0.9, 0.95)


def draw_all(shifts: Shifts) -> list[Drawn]:
    """Every figure that the tables have the columns for, in the order of the report."""
    with styled():
        drawn = [trade(shifts), stages(shifts), fates_in_time(shifts), way(shifts)]
        drawn += [percentiles(shifts), burden(shifts)]
    return [figure for figure in drawn if figure is not None]


def _looks(shifts: Shifts) -> dict[Level, Look]:
    """Of each policy, the same in every figure."""
    return looks(Factor("dispatch.policy", shifts.policies))


# --- the trade -----------------------------------------------------------------------------
def trade(shifts: Shifts) -> Drawn | None:
    """Response against exposure, a mark for each policy, a panel for each load."""
    if not shifts.can_spare:
        return None
    label = "Exposure of people in finding out what it is [s per event]"
    figure = _scatter(shifts, "exposure_look_s", label)
    title = "The trade: how soon somebody is there, against how long people stand in danger"
    caption = (
        "Down and to the left is better; the line joins the policies that no other beats on both. "
        f"Response is the mean of min(time, {shifts.follow:g} s) over all events. Exposure is "
        "guards' time within the danger radius on the way to look, looking and leaving; containing "
        f"comes on top and costs about {_act(shifts):.0f} s per event whoever was sent. "
        f"{_bars_words(shifts)}"
    )
    return finish(figure, "trade", title, caption, _scatter_numbers(shifts, "exposure_look_s"))


def stages(shifts: Shifts) -> Drawn | None:
    """Response against containment: who looks first contains later."""
    if not shifts.view.part.has("containment_mean_s"):
        return None
    figure = _scatter(shifts, "containment_mean_s", "Restricted mean time to containment [s]")
    title = "Looking first or containing first: response against containment"
    caption = (
        "Down and to the left is better; the line joins the policies that no other beats on both. "
        f"Both are means of min(time, {shifts.follow:g} s) from the report: of all events until "
        "somebody is on scene, and of the true ones until a person has dealt with them. The same "
        f"guards do both. {_bars_words(shifts)}"
    )
    numbers = _scatter_numbers(shifts, "containment_mean_s")
    return finish(figure, "stages", title, caption, numbers)


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
    """Means, and half-widths of the difference against the baseline."""
    numbers = Numbers()
    told: dict[str, Any] = {}
    for name in ("response_mean_s", column):
        told[name] = shifts.means(name)
        told[with_unit(f"{name.removesuffix('_s')}_half_width", name)] = _half_widths(shifts, name)
    for stop, title in enumerate(shifts.titles):
        at_stop: dict[str, Any] = {name: values[:, stop] for name, values in told.items()}
        numbers.add({"at": title}, at_stop | {"dispatch.policy": shifts.policies})
    return numbers


def _bars_words(shifts: Shifts) -> str:
    return (
        f"Bars: 95 % interval of the difference against {shifts.baseline}, paired by shift, for "
        "all policies and loads at once. The axes differ from panel to panel."
    )


def _act(shifts: Shifts) -> float:
    """What containing costs, in the middle of all cells [s per event]."""
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
def fates_in_time(shifts: Shifts) -> Drawn | None:
    """Cumulative incidence by cause, stacked, for some policies at every load."""
    if not shifts.events:
        return None
    chosen = chosen_policies(shifts)
    figure, axes = panels(len(shifts.stops), len(chosen), 2.0, sharex=True, sharey=True)
    times, numbers = np.linspace(0.0, shifts.follow, 301), Numbers()
    for stop, row in enumerate(axes):
        for policy, ax in zip(chosen, row, strict=True):
            events = dict(shifts.events_of(policy, stop))
            if len(events["event_id"]):
                shares = _shares(measures.fates(events), times)
                _stack(ax, shares, times)
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
    key(figure, [box(FATES[fate]) for fate in _FATES], [_NAMES.get(f, f) for f in _FATES])
    caption = (
        "Cumulative incidence of each outcome (Aalen-Johansen), stacked: at every moment the "
        f"shares add up to one. All events, true and false, each followed for {shifts.follow:g} s."
    )
    return finish(figure, "fates", "What becomes of events, and when", caption, numbers)


def chosen_policies(shifts: Shifts) -> list[str]:
    """The floor, the two of the contrast, and the quickest at the highest load; four at most."""
    response = shifts.means("response_mean_s")[:, -1]
    quickest = [shifts.policies[i] for i in np.argsort(response, kind="stable")]
    wanted = [FLOOR, *reversed([str(c) for c in shifts.view.contrast or ()]), *quickest]
    return list(dict.fromkeys(p for p in wanted if p in shifts.policies))[:4]


def _shares(curve: Any, times: Any) -> dict[str, Any]:
    """Cumulative incidence of each outcome at these times, and what is still open."""
    shares = {fate: curve.at(times, 1 + i) for i, fate in enumerate(measures.FATES)}
    return shares | {"open": 1.0 - sum(shares.values())}


def _stack(ax: Axes, shares: dict[str, Any], times: Any) -> None:
    bottom = np.zeros_like(times)
    for fate in _FATES:
        colour, hatch = FATES[fate]
        top = bottom + shares[fate]
        ax.fill_between(times, bottom, top, facecolor=colour, hatch=hatch, edgecolor=PAPER, lw=0)
        bottom = top


# --- one line per policy ---------------------------------------------------------------------
def way(shifts: Shifts) -> Drawn | None:
    """How far of the way from the floor to the best possible each policy gets."""
    if shifts.target is None or not shifts.travellers:
        return None
    names, numbers, look = shifts.travellers, Numbers(), _looks(shifts)
    figure, (axes,) = panels(1, len(shifts.stops), _height(len(names)), sharey=True)
    for stop, ax in enumerate(axes):
        found = shifts.progress(stop)
        told: dict[str, Any] = {
            "share": found.mean,
            "share_low": found.low,
            "share_high": found.high,
        }
        numbers.add({"at": shifts.titles[stop]}, told | {"dispatch.policy": names})
        for row, policy in enumerate(names):
            colour, mark = look[policy]
            ax.hlines(row, 100 * found.low[row], 100 * found.high[row], color=colour, lw=1.6)
            ax.plot(100 * found.mean[row], row, marker=mark, color=colour, ms=7)
        ax.axvline(100, color=INK, lw=0.8)
        ax.axvline(0, color=SOFT, lw=0.8, ls=":")
        _policy_axis(ax, names, capital(shifts.titles[stop]))
    target = "the oracle" if shifts.target == BEST else "a fresh unit at every base"
    axes[len(axes) // 2].set_xlabel(f"Share of the way from {FLOOR} to {target} [%]")
    title = (
        f"How much of what can be gained in response each policy gains: 0 is {FLOOR}, 100 {target}"
    )
    return finish(figure, "way", title, _way_words(shifts), numbers)


def _way_words(shifts: Shifts) -> str:
    words = (
        f"(random - policy) / (random - {'oracle' if shifts.target == BEST else 'bound'}) of the "
        "restricted mean response, paired by shift; the 95 % intervals hold for all policies of a "
        "panel at once. "
    )
    if shifts.target == BEST:
        return words + (
            "The oracle knows all alarms before they come and follows the plan with the least sum "
            "of response times; nobody can be beyond it."
        )
    beats = shifts.means("beats_bound_share")
    return words + (
        "The bound is the response of the best unit for each event if it stood idle at its base or "
        "a station: no queue, no limit of operators, the event's own luck. It is none for who is "
        "out already and needs no time to get ready: "
        f"{100 * np.nanmin(beats):.0f} to {100 * np.nanmax(beats):.0f} % of events were answered "
        "sooner."
    )


def percentiles(shifts: Shifts) -> Drawn | None:
    """Half, nine tenths and 95 % of all events had somebody on scene by ..."""
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
            told: dict[str, Any] = {
                "response_s": value,
                "response_low_s": low,
                "response_high_s": high,
            }
            numbers.add(where, told | {"quantile": _QUANTILES})
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
    never = (
        f" An arrow, or a bar up to {shifts.follow:g} s: perhaps not reached." if missing else ""
    )
    caption = (
        "Over all events of the cohort, those that nobody ever reached counting as infinitely "
        f"late.{never} Broad bars: 95 % interval of each percentile alone, shifts drawn anew. "
        "The axes differ from panel to panel."
    )
    return finish(figure, "percentiles", "Percentiles of the time to response", caption, numbers)


def burden(shifts: Shifts) -> Drawn | None:
    """Who works how much, and how evenly work and service are spread."""
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
        told: dict[str, Any] = {column: shifts.means(column)[:, stop] for column in there}
        numbers.add({"at": title}, told | {"dispatch.policy": names})
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
    title = "How busy people are, and how evenly work and service are spread"
    caption = (
        f"Small to large: {', '.join(shifts.titles)}. Means over shifts. Use: share of the "
        "measured time with an order. Evenness: Jain's index of the guards' busy time, 1 if all "
        "work the same. On the right, the restricted mean response in the worst zone over that in "
        f"the best, of zones with at least {measures.FEWEST_IN_ZONE} events in the shift: chance "
        "alone lifts it above 1, under every policy."
    )
    return finish(figure, "burden", title, caption, numbers)


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
