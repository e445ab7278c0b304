"""Promises of figures: kept by the shipped ones, missed by the bad ones."""

import itertools

import numpy as np
import pytest
from helpers.processes.search_settings import LONGER
from helpers.studies import figure_promises as figures
from helpers.studies.figure_promises import check_figure
from helpers.studies.made_up_results import SHAPES

from dva_sim.experiments.report.figures.csv_numbers import Numbers
from dva_sim.experiments.report.figures.palette import is_of_palette
from dva_sim.experiments.report.figures.registry import SHIPPED
from dva_sim.experiments.report.figures.style import ReportFigure, panels
from dva_sim.kernel.errors import ConfigError
from dva_sim.testing.promises import tried

FEW = {name: SHAPES[name] for name in ("two words", "no value at all")}
COMPUTED = {"distributions"}  # its boxes are quartiles of the runs, which its CSV holds
OF_OTHER_DESIGNS = {"claims", "scatter"}  # registered; in ranges


class Plain(ReportFigure):
    """Every run, beside each other."""

    name = "plain"
    title = "Every run"

    def draw(self, view, reading):
        values = view.part.values(view.measure)
        values = values[np.isfinite(values)]
        figure, ((ax,),) = panels(1, 1, 2.0)
        numbers = Numbers()
        self.mark(ax, values)
        numbers.add({}, {view.measure: self.written(values)})
        return self.finish(figure, "Each mark is a run.", numbers)

    def mark(self, ax, values):
        ax.plot(range(len(values)), values, "o", color="#0072B2")
        ax.set_xticks([])

    def written(self, values):
        return values


def but(**changed):
    """A figure that is good but for this."""
    return type("Bad", (Plain,), changed)


def small_words(self, ax, values):
    Plain.mark(self, ax, values)
    ax.set_ylabel("drive time", fontsize=5)


def broad(self, ax, values):
    Plain.mark(self, ax, values)
    ax.figure.set_figwidth(20)


drawings = itertools.count()


def lime(self, ax, values):
    ax.plot(values, values, "o", color="lime")


def now_and_then(self, ax, values):
    Plain.mark(self, ax, values[: len(values) - next(drawings) % 2])


def speechless(self, figure, caption, numbers):
    return Plain.finish(self, figure, "", numbers)


def careless(self, view, reading):
    from matplotlib import pyplot

    pyplot.figure()
    return Plain.draw(self, view, reading)


def meddling(self, view, reading):
    reading.table("runs")["drive_time_s"][0] = 0.0


class Misnamed(Plain):
    def finish(self, figure, caption, numbers, **more):
        self.name = "other"
        drawn = super().finish(figure, caption, numbers, **more)
        del self.name
        return drawn


class Refusing(Plain):
    def draw(self, view, reading):
        if not view.part.has(view.measure):
            raise ConfigError("there is no drive to draw")
        return super().draw(view, reading)


@pytest.mark.parametrize(
    ("bad", "promise", "expected"),
    [
        (but(written=lambda self, values: values[1:]), figures.NUMBERS, "along y by a line"),
        (but(mark=lime), figures.COLOUR, "#00ff00 of a Line2D"),
        (but(mark=small_words), figures.SMALL, "'drive time' in 5.0 pt"),
        (but(mark=broad), figures.SMALL, "6 pt"),
        (but(mark=now_and_then), figures.CHANGES, "other bytes"),
        (but(draw=careless), figures.OPEN, "panels()"),
        (but(draw=meddling), figures.TOUCHES, "read-only"),
        (but(draw=lambda self, _, r: r.table("events")["outcome"][0]), figures.EMPTY, "KeyError"),
        (but(finish=speechless), figures.UNEXPLAINED, "caption ''"),
        (but(tables=("runs", "nowhere")), figures.NEVER, "runs, nowhere"),
        (Misnamed, figures.NAME, "'other' for 'plain'"),
    ],
)
def test_a_figure_that_breaks_a_promise_is_told_of_it(bad, promise, expected):
    shape = "no value at all" if promise == figures.EMPTY else "two words"
    outcome = tried(check_figure, bad, shapes={shape: SHAPES[shape]})
    assert [text for text in outcome.broken if text.startswith(f"{promise}: ") and expected in text]


@pytest.mark.parametrize(
    "good",
    [
        Plain,
        Refusing,
        but(written=lambda self, values: values / 100),  # drawn in percent
        but(written=lambda self, values: values / 1000),  # drawn in milliseconds
    ],
)
def test_a_figure_that_keeps_its_promises_breaks_none(good):
    outcome = tried(check_figure, good, shapes=FEW)
    assert (outcome.broken, outcome.warnings) == ((), ())


def test_a_colour_of_the_palette_is_known_however_it_is_written():
    assert is_of_palette("#0072b2")
    assert is_of_palette("#0072B2")
    assert not is_of_palette("#00ff00")


@pytest.mark.soak
@pytest.mark.parametrize("figure", SHIPPED, ids=lambda figure: figure.name)
def test_every_figure_that_is_shipped_keeps_its_promises(figure):
    """Takes results of every model, and one rare kind each; the long search takes all kinds."""
    usual = {shape.model: name for name, shape in reversed(SHAPES.items())}
    rare = [name for name in SHAPES if name not in usual.values()]
    taken = rare if LONGER > 1 else [rare[SHIPPED.index(figure) % len(rare)]]
    shapes = {name: SHAPES[name] for name in (*usual.values(), *taken)}
    outcome = tried(check_figure, figure, slow=60.0, shapes=shapes)
    promises = {text.partition(":")[0] for text in outcome.broken}
    if figure.name in COMPUTED:
        promises -= {figures.NUMBERS}
    assert promises == ({figures.NEVER} if figure.name in OF_OTHER_DESIGNS else set()), outcome
