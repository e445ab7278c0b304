"""What a report says in words and tables about a study of transports.

The figures of a study of transports: what each brings, what it takes, and how one drives.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dva_sim.experiments.analysis.paired_effects import Floats, View, nan_mean, person_means
from dva_sim.experiments.report.cell_table import Summary
from dva_sim.experiments.report.figures import effect
from dva_sim.experiments.report.figures.palette import INK, Look, legend, looks
from dva_sim.experiments.report.figures.style import (
    Drawn,
    Numbers,
    finish,
    log_axis,
    panels,
    stops_axis,
    styled,
)
from dva_sim.experiments.study.labels import number, percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes


SUMMARIES: tuple[Summary, ...] = (
    ("completed", "drives done", np.mean, percent),
    ("wall_crossings", "crossings per drive", np.mean, number),
    ("round_trip_mean_s", "round trip [s]", np.mean, number),
    ("round_trip_p95_s", "its 95th percentile [s]", np.mean, number),
    ("delivered_share", "commands delivered", np.mean, percent),
    ("crucial_delivered_share", "crucial ones", np.mean, percent),
    ("command_rate_hz", "applied [Hz]", np.mean, number),
    ("command_age_mean_s", "age when applied [s]", np.mean, number),
    ("age_in_force_mean_s", "age in force [s]", np.mean, number),
    ("picture_rate_hz", "pictures shown [Hz]", np.mean, number),
    ("picture_age_mean_s", "their age [s]", np.mean, number),
    ("session_up_bps", "session up [bit/s]", np.mean, number),
    ("session_down_bps", "session down [bit/s]", np.mean, number),
    ("bulk_down_bps", "a TCP flow down [bit/s]", np.mean, number),
    ("share_of_fair_down", "session, in equal shares", np.mean, number),
    ("bulk_use_down", "line used by TCP, down", np.mean, percent),
    ("jain_up", "Jain's index up", np.mean, number),
    ("jain_down", "Jain's index down", np.mean, number),
)


def is_contest(view: View | None) -> bool:
    """Whether a study compares sessions on a congested link."""
    return view is not None and view.part.has("session_down_bps")


def method(correlation: float | None) -> list[str]:
    """How the numbers were made, as a list of remarks."""
    alike = ""
    if correlation is not None:
        alike = (
            f" The two sides of the contrast correlate with {correlation:.2f} at the last level."
        )
    return [
        "The network is simulated first, packet by packet, and then somebody drives over the fates "
        "of commands and pictures as they were: what is sent does not depend on what is driven. A "
        "drive begins at a moment drawn for it and goes on from the beginning of the measured time "
        "when it outlasts it.",
        "The person is the cluster: intervals are taken over persons. A person's run meets the "
        "same beginnings of all flows, the same noise of hand and judgement and the same place in "
        f"the measured time under every transport; differences are taken within it.{alike}",
        "Intervals of one level reach as far as Student's or the bootstrap-t over persons does; "
        "bands cover all levels of a line at once (max-t over a bootstrap of persons). Both are "
        "Monte Carlo intervals, given the model.",
        "Trinomial, RTNP, IRTP and BTP are in the manner of their papers: only abstracts could be "
        "read, laws and numbers are not theirs. What is found here speaks for the laws as they "
        "stand in the program, which says of each what is missing.",
        "A command is applied if it arrives before any newer one; a picture is shown once all of "
        "it is there. Messages that count may arrive up to five seconds after the last of them.",
        "Not modelled: what processing at the hosts costs, encoding of pictures to fit the rate "
        "(all have the same size), active queue management, and the radio itself. Operators are "
        "control models; no human took part.",
    ]


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
