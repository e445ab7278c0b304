"""What every figure promises: kept by those that are shipped, missed by the bad ones."""

import csv
import io

import numpy as np
import pytest
from helpers.processes.search_settings import LONGER

from dva_sim.cli import checks
from dva_sim.experiments.report.figures import Numbers, ReportFigure, panels
from dva_sim.experiments.report.figures.palette import is_of_palette
from dva_sim.experiments.report.figures.registry import PLUGINS, SHIPPED
from dva_sim.kernel.errors import ConfigError
from dva_sim.testing import figures
from dva_sim.testing.figures import check_figure
from dva_sim.testing.promises import tried
from dva_sim.testing.results import SHAPES

FEW = {name: SHAPES[name] for name in ("two words", "no value at all")}
COMPUTED = {"distributions"}  # its boxes are quartiles of the runs, which its CSV holds
OF_OTHER_DESIGNS = {"scatter", "sobol", "robustness"}  # of points in ranges, of repeats


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


class Forgetful(Plain):
    def written(self, values):
        return values[1:]


class Garish(Plain):
    def mark(self, ax, values):
        ax.plot(range(len(values)), values, "o", color="lime")
        ax.set_xticks([])


class Tiny(Plain):
    def mark(self, ax, values):
        super().mark(ax, values)
        ax.set_ylabel("drive time", fontsize=5)


class Broad(Plain):
    def mark(self, ax, values):
        super().mark(ax, values)
        ax.figure.set_figwidth(20)


class Restless(Plain):
    drawings = 0

    def mark(self, ax, values):
        Restless.drawings += 1
        super().mark(ax, values[: len(values) - Restless.drawings % 2])


class Careless(Plain):
    def draw(self, view, reading):
        from matplotlib import pyplot

        pyplot.figure()
        return super().draw(view, reading)


class Meddling(Plain):
    def draw(self, view, reading):
        reading.table("runs")["drive_time_s"][0] = 0.0
        return super().draw(view, reading)


class Trusting(Plain):
    def draw(self, view, reading):
        reading.table("events")["outcome"][0]
        return super().draw(view, reading)


class Silent(Plain):
    def finish(self, figure, caption, numbers, **more):
        return super().finish(figure, "", numbers, **more)


class Picky(Plain):
    tables = ("runs", "nowhere")


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
    ("bad", "promise", "told"),
    [
        (Forgetful, figures.NUMBERS, "along y by a line"),
        (Garish, figures.COLOUR, "#00ff00 of a Line2D"),
        (Tiny, figures.SMALL, "'drive time' in 5.0 pt; should be 6 pt"),
        (Broad, figures.SMALL, "should be 6 pt"),
        (Restless, figures.CHANGES, "other bytes"),
        (Careless, figures.OPEN, "draw in that of panels()"),
        (Meddling, figures.TOUCHES, "read-only"),
        (Trusting, figures.EMPTY, "KeyError"),
        (Silent, figures.UNSAID, "should be sentences"),
        (Picky, figures.NEVER, "although they have runs, nowhere"),
        (Misnamed, figures.NAME, "'other' for 'plain'"),
    ],
)
def test_a_figure_that_breaks_a_promise_is_told_of_it(bad, promise, told):
    outcome = tried(check_figure, bad, shapes=FEW)
    assert [text for text in outcome.broken if text.startswith(f"{promise}: ") and told in text]


@pytest.mark.parametrize("good", [Plain, Refusing])
def test_a_figure_that_keeps_its_promises_breaks_none(good):
    outcome = tried(check_figure, good, shapes=FEW)
    assert (outcome.broken, outcome.warnings) == ((), ())


def test_numbers_may_be_drawn_in_percent_or_milliseconds_but_not_as_others():
    known = figures._numbers(b"share,time_s\n0.25,1.5\n")
    assert not len(figures._missing(np.array([25.0, 1500.0, 0.0, np.nan]), known))
    assert figures._missing(np.array([26.0]), known).tolist() == [26.0]


def test_a_colour_of_the_palette_is_known_however_it_is_written():
    assert is_of_palette("#0072b2")
    assert is_of_palette("#0072B2")
    assert not is_of_palette("#00ff00")


def test_what_is_drawn_is_written_beside_the_worked_example(capsys):
    assert checks.check(["figure", "risk.py:Risk"]) == checks.VALID
    assert "risk.py:Risk: figure: valid" in capsys.readouterr().out


def test_a_figure_without_a_way_to_be_drawn_is_refused_in_a_line(tmp_path):
    (tmp_path / "mine.py").write_text(
        "from dva_sim.experiments.report.figures import ReportFigure\n"
        "class Mine(ReportFigure):\n    name = 'mine'\n"
    )
    with pytest.raises(ConfigError, match=r"has no draw\(view, reading\); should define it"):
        PLUGINS.find("mine.py:Mine", tmp_path)


@pytest.mark.soak
@pytest.mark.parametrize("figure", SHIPPED, ids=lambda figure: figure.name)
def test_every_figure_that_is_shipped_keeps_its_promises(figure):
    """Of every model's results, and of one rare kind each; the long search takes all kinds."""
    usual = {shape.model: name for name, shape in reversed(SHAPES.items())}
    rare = [name for name in SHAPES if name not in usual.values()]
    taken = rare if LONGER > 1 else [rare[SHIPPED.index(figure) % len(rare)]]
    shapes = {name: SHAPES[name] for name in (*usual.values(), *taken)}
    outcome = tried(check_figure, figure, slow=60.0, shapes=shapes)
    promises = {text.partition(":")[0] for text in outcome.broken}
    if figure.name in COMPUTED:
        promises -= {figures.NUMBERS}
    assert promises == ({figures.NEVER} if figure.name in OF_OTHER_DESIGNS else set()), outcome


def test_rows_of_a_figure_can_be_read_as_a_table():
    numbers = Numbers()
    numbers.add({"pattern": "req-rep"}, {"t_s": [1.0, 2.0]})
    rows = list(csv.DictReader(io.StringIO(numbers.csv().decode())))
    assert rows == [{"pattern": "req-rep", "t_s": "1"}, {"pattern": "req-rep", "t_s": "2"}]
