import re
from functools import cache

import pytest
from matplotlib.figure import Figure

from dva_sim.experiments.report.blocks import (
    FigureBlock,
    First,
    Folded,
    Heading,
    Items,
    Printed,
    Terms,
    Verbatim,
    Words,
)
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.figures.style import Numbers, finish
from dva_sim.experiments.report.pdf import (
    Face,
    _squeezed,
    broken,
    columns_that_fit,
    width_of,
    write_pdf,
)

FACE = Face(9)


@cache
def drawn():
    figure = Figure(figsize=(8.4, 3))
    figure.subplots().plot([0, 1], [0, 1])
    return finish(figure, "line", "A line", "It ascends.")


def blocks():
    rows = [[f"cell\n{n}", "1.0 (0.5 to 1.5)"] for n in range(80)]
    return [
        Words("Declared", "label"),
        First("It costs 4.5 s.", drawn(), (("Persons", "24 simulated."),)),
        Heading("Figures"),
        FigureBlock(drawn()),
        Items(("one", "two")),
        Printed(CellTable("drive", ["cell", "mean"], 1, rows, note="All of them.")),
        Folded("Manifest", (Verbatim('{\n  "seed": 1\n}'),)),
        Terms((("word-band", "band", "All levels at once."),)),
    ]


@pytest.mark.system
def test_a_report_on_paper_has_the_same_bytes_whenever_it_is_set(tmp_path):
    for name in ("a.pdf", "b.pdf"):
        write_pdf(tmp_path / name, "What does it cost?", blocks())
    content = (tmp_path / "a.pdf").read_bytes()
    assert content == (tmp_path / "b.pdf").read_bytes()
    assert b"CreationDate (D:20000101000000Z)" in content
    # A table goes on over pages, and figures stay vectors.
    assert len(re.findall(rb"/Type /Page\b", content)) == 3
    assert b"/Subtype /Image" not in content


def test_text_is_broken_into_lines_that_fit_and_loses_no_word():
    text = "the quick brown fox jumps over the lazy dog " * 5
    lines = list(broken(text, FACE, 120.0))
    assert max(width_of(line, FACE) for line in lines) <= 120.01
    assert " ".join(lines).split() == text.split()


def test_a_number_stays_with_its_unit():
    lines = list(broken("takes 91.3\N{NO-BREAK SPACE}s longer", FACE, width_of("takes 91.3", FACE)))
    assert lines == ["takes", "91.3\N{NO-BREAK SPACE}s", "longer"]


def test_a_word_wider_than_the_line_is_cut():
    lines = list(broken("x" * 100, FACE, 60.0))
    assert len(lines) > 1
    assert "".join(lines) == "x" * 100


@pytest.mark.parametrize(
    ("room", "groups"),
    [(100.0, [[0, 1, 2, 3]]), (60.0, [[0, 1, 2], [0, 3]]), (10.0, [[0, 1], [0, 2], [0, 3]])],
)
def test_columns_that_do_not_fit_go_below_with_the_names_of_their_rows(room, groups):
    assert columns_that_fit([20.0] * 4, labels=1, room=room) == groups


def test_no_word_in_the_head_of_a_squeezed_table_is_cut():
    table = CellTable("", ["claim", "verdict"], 2, [["a long claim " * 20, "held"]])
    bold = Face(9, "bold")
    widths = _squeezed(table, FACE, bold, [900.0, 40.0], 300.0)
    assert sum(widths) == pytest.approx(300.0)
    assert widths[1] > width_of("verdict", bold) > width_of("verdict", FACE)


def test_numbers_behind_a_figure_are_rows_with_levels_and_gaps():
    numbers = Numbers()
    numbers.add(
        {"pattern": "req-rep"}, {"link.delay_s": [0.0, 0.5], "mean_s": [1.25, float("nan")]}
    )
    numbers.row({"pattern": None}, is_found=True)
    assert numbers.csv().decode().splitlines() == [
        "pattern,link.delay_s,mean_s,is_found",
        "req-rep,0,1.25,",
        "req-rep,0.5,,",
        ",,,true",
    ]
