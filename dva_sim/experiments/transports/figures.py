"""The figures of a study of transports: what each brings, what it takes, and how one drives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dva_sim.experiments.effects import Floats, View, nan_mean, person_means
from dva_sim.experiments.figures import effect
from dva_sim.experiments.figures.keys import legend
from dva_sim.experiments.figures.numbers import Numbers
from dva_sim.experiments.figures.palette import INK, Look, looks
from dva_sim.experiments.figures.style import Drawn, finish, log_axis, panels, stops_axis, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH = 0.6  # of the marks of a stop, side by side


class Shown(NamedTuple):
    """A panel: a column, its title, the factor to its unit, and whether its axis is logarithmic."""

    column: str
    title: str
    scale: float = 1.0
    is_log: bool = False


BROUGHT = (
    Shown("round_trip_mean_s", "Round trip [s]", is_log=True),
    Shown("round_trip_p95_s", "Round trip, 95th percentile [s]", is_log=True),
    Shown("picture_rate_hz", "Pictures shown [Hz]"),
    Shown("picture_age_p95_s", "Age of pictures, 95th percentile [s]", is_log=True),
    Shown("command_rate_hz", "Commands applied [Hz]"),
    Shown("age_in_force_mean_s", "Age of the command in force [s]", is_log=True),
)
TAKEN = (
    Shown("session_down_bps", "Rate of the session, pictures' way [kbit/s]", scale=1e-3),
    Shown("share_of_fair_down", "The same in shares of an equal one"),
    Shown("bulk_use_down", "All TCP flows, share of the line"),
    Shown("jain_down", "Jain's index of fairness"),
)
FELT = (
    Shown("movement_time_s", "Driving time [s]", is_log=True),
    Shown("delay_felt_s", "Delay as the person takes it [s]", is_log=True),
)


def draw_all(view: View) -> list[Drawn]:
    """Every figure, in the order of the report."""
    with styled():
        drawn = [
            effect.differences(view, lambda panel: None),
            _drawn(view, "brought", FELT + BROUGHT, _BROUGHT_TITLE, _BROUGHT_CAPTION),
            _drawn(view, "taken", TAKEN, _TAKEN_TITLE, _TAKEN_CAPTION),
        ]
    return [figure for figure in drawn if figure is not None]


_BROUGHT_TITLE = "What each transport brings, and how one drives with it"
_BROUGHT_CAPTION = (
    "Mean over persons; bars, where they are longer than the mark, the middle 90 % of persons, who "
    "meet competitors of different luck. A round trip lasts from a command until the first picture "
    "taken after it was applied has arrived. The age in force is that of the newest command that "
    "the robot has, over time. A drive that was not done counts with its horizon."
)
_TAKEN_TITLE = "What each transport takes, and what it leaves to TCP"
_TAKEN_CAPTION = (
    "With all headers and what is sent again. A dashed line at 1 is an equal share. Jain's index "
    "is 1 if session and TCP flows have the same rate; a session that wants less than its share "
    "lowers it without taking anything from anybody. Bars as above."
)


def _drawn(
    view: View, name: str, shown: tuple[Shown, ...], title: str, caption: str
) -> Drawn | None:
    there = [each for each in shown if view.part.has(each.column)]
    if not there:
        return None
    rows = (len(there) + 1) // 2
    figure, grid = panels(rows, 2, 2.3)
    axes = [ax for row in grid for ax in row]
    for ax, each in zip(axes, there, strict=False):
        _panel(ax, view, each)
    for ax in axes[len(there) :]:
        ax.set_visible(False)
    for ax in axes[: len(there) - 2]:
        ax.set_xlabel("")
    legend(figure, view.line)
    return finish(figure, name, title, caption, _numbers(view, there))


def _numbers(view: View, shown: Sequence[Shown]) -> Numbers:
    """Means over persons, in the units of the table of runs."""
    numbers, panel = Numbers(), view.panels[0]
    grids = {each.column: view.part.grid(each.column) for each in shown}
    for level in view.lines:
        curves = {name: view.curve(grid, panel, level) for name, grid in grids.items()}
        means = {name: nan_mean(person_means(curve), axis=0) for name, curve in curves.items()}
        numbers.add(view.setting(panel, level), view.along_x() | means)
    return numbers


def _panel(ax: Axes, view: View, shown: Shown) -> None:
    grid, count = shown.scale * view.part.grid(shown.column), len(view.lines)
    for index, (level, look) in enumerate(looks(view.line).items()):
        values = person_means(view.curve(grid, view.panels[0], level))
        place = WIDTH * ((index + 0.5) / count - 0.5)
        _marks(ax, place, values, look)
    ax.set_title(shown.title, fontweight="normal")
    stops_axis(ax, view.over)
    if shown.is_log:
        log_axis(ax)
    else:
        ax.set_ylim(bottom=0)
    if shown.column.startswith(("share_of_fair", "jain")):
        ax.axhline(1.0, color=INK, lw=0.8, ls=(0, (4, 2)), zorder=1)


def _marks(ax: Axes, place: float, values: Floats, look: Look) -> None:
    """Means over persons of `values` `(persons, stops)`, with the middle 90 % of them."""
    means = nan_mean(values, axis=0)
    stops = np.flatnonzero(np.isfinite(means))
    if not len(stops):
        return
    low, high = np.nanpercentile(values[:, stops], [5, 95], axis=0)
    ax.vlines(stops + place, low, high, color=look.colour, lw=1.2, zorder=2)
    ax.plot(stops + place, means[stops], look.mark, color=look.colour, ms=4.5, zorder=3)
