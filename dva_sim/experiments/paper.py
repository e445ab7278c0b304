"""The blocks of a report set on paper: A4 as PDF, figures as vectors, text that can be searched."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dva_sim.experiments.blocks import (
    Block,
    First,
    Folded,
    Heading,
    Items,
    Kind,
    Printed,
    Shown,
    Terms,
    Verbatim,
    Words,
    reworded,
    texts_of,
)
from dva_sim.experiments.cells import CellTable
from dva_sim.experiments.figures.palette import SOFT, WARNING
from dva_sim.experiments.glossary import RING, Marker, terms_in
from dva_sim.experiments.typeset import (
    SMALL,
    Face,
    Paper,
    broken,
    columns_that_fit,
    width_of,
    words_of,
)

if TYPE_CHECKING:
    from dva_sim.experiments.figures.style import Drawn

_TITLE = Face(16, "bold")
_SECTION, _BELOW = Face(12, "bold"), Face(9.5, "bold")
_PLAIN, _LEAD = Face(9), Face(10.5, "bold")
_KINDS: dict[Kind, Face] = {
    "plain": _PLAIN,
    "note": SMALL,
    "warning": Face(9, "bold", colour=WARNING),
    "label": Face(9, "bold"),
    "caution": Face(9, "bold", colour=WARNING),
    "banner": Face(10.5, "bold", colour=WARNING),
}
_MONO = Face(5.5, family="DejaVu Sans Mono")
_CELL, _HEAD = Face(7), Face(7, "bold", colour=SOFT)
_TIGHT, _TIGHT_HEAD = Face(6), Face(6, "bold", colour=SOFT)
_GAP = 9.0  # between columns [pt]
_NAMES = 0.4  # of the width is what names of rows may take before they are broken
_INDENT = 10.0  # of a list, and of the answer [pt]
_ANSWERING = 340.0  # width of the figure that answers, so that the first page holds all [pt]


def write_pdf(path: Path, question: str, blocks: Sequence[Block]) -> None:
    """Set a report; the same blocks give the same bytes."""
    from matplotlib import rc_context

    with rc_context({"pdf.fonttype": 42, "pdf.compression": 6, "text.usetex": False}):
        paper = Paper(path, question)
        terms = terms_in(texts_of(blocks))
        ringed = reworded(blocks, Marker(terms).ringed)
        banners = [b for b in ringed if isinstance(b, Words) and b.kind == "banner"]
        for banner in banners:
            _set(paper, banner)
        _text(paper, question, _TITLE)
        if terms:
            _text(paper, f"The list at the end explains words marked {RING}.", SMALL)
        for block in ringed:
            if block not in banners:
                _set(paper, block)
        paper.close()


def _set(paper: Paper, block: Block) -> None:
    if isinstance(block, Heading):
        _heading(paper, block)
    elif isinstance(block, Words):
        _text(paper, block.text, _KINDS[block.kind])
    elif isinstance(block, First):
        _first(paper, block)
    elif isinstance(block, Items):
        _items(paper, block.items)
    elif isinstance(block, Printed):
        _table(paper, block.table, block.is_words)
    elif isinstance(block, Shown):
        _figure(paper, block.figure)
    elif isinstance(block, Terms):
        _terms(paper, block)
    elif isinstance(block, Folded):
        _heading(paper, Heading(block.title, 3))
        for inner in block.blocks:
            _set(paper, inner)
    else:
        _verbatim(paper, block)


def _items(paper: Paper, items: Sequence[str]) -> None:
    for item in items:
        paper.need(_PLAIN.leading)
        paper.line("•", _PLAIN)
        _text(paper, item, _PLAIN, _INDENT)


def _terms(paper: Paper, block: Terms) -> None:
    """A word and what it means in a line or two."""
    for _, name, means in block.entries:
        _text(paper, f"{name}: {means}", SMALL, after=1.5)


def _text(paper: Paper, text: str, face: Face, x: float = 0.0, after: float = 4.0) -> None:
    """A paragraph, broken into lines and over pages."""
    for line in broken(text, face, paper.width - x):
        paper.need(face.leading)
        paper.line(line, face, x)
        paper.y -= face.leading
    paper.skip(after)


def _heading(paper: Paper, block: Heading) -> None:
    face = _SECTION if block.level == 2 else _BELOW
    paper.skip(face.size)
    paper.need(8 * face.leading)  # a heading at the foot of a page is lost
    _text(paper, block.text, face)


def _first(paper: Paper, block: First) -> None:
    """The answer between two rules, the figure that answers, and what it depends on."""
    paper.skip(4)
    paper.rule()
    paper.y -= 7
    _text(paper, block.lead, _LEAD, after=5)
    paper.rule()
    paper.skip(10)
    if block.figure is not None:
        _figure(paper, block.figure, _ANSWERING)
    if block.depends:
        _heading(paper, Heading("What this depends on", 3))
        _items(paper, [f"{about}: {words}" for about, words in block.depends])


def _figure(paper: Paper, drawn: Drawn, most: float = math.inf) -> None:
    """Title, figure and caption on one page; smaller where it is too high for that."""
    if drawn.figure is None:
        return
    title = list(broken(drawn.title, _BELOW, paper.width))
    caption = list(broken(drawn.caption, SMALL, paper.width))
    words = len(title) * _BELOW.leading + len(caption) * SMALL.leading + 12
    wide, high = drawn.figure.get_size_inches()
    width = min(most, paper.width, (paper.height - words) * float(wide) / float(high))
    height = width * float(high) / float(wide)
    paper.need(words + height)
    _text(paper, drawn.title, _BELOW)
    paper.place(drawn.figure, width, height)
    paper.y -= 4
    _text(paper, drawn.caption, SMALL, after=12)


def _verbatim(paper: Paper, block: Verbatim) -> None:
    """Line by line, in two columns."""
    width = (paper.width - _GAP) / 2
    most = int(width / width_of("m", _MONO))
    lines = [
        line[start : start + most]
        for line in block.text.splitlines()
        for start in range(0, max(1, len(line)), most)
    ]
    while lines:
        rows = max(1, int(paper.room / _MONO.leading))
        rows = min(rows, -(-len(lines) // 2))
        top = paper.y
        for column in range(2):
            paper.y = top
            for line in lines[column * rows : (column + 1) * rows]:
                paper.line(line, _MONO, column * (width + _GAP))
                paper.y -= _MONO.leading
        paper.y = top - rows * _MONO.leading
        lines = lines[2 * rows :]
        paper.need(_MONO.leading)


# --- tables ----------------------------------------------------------------------------------


def _table(paper: Paper, table: CellTable, is_words: bool) -> None:
    """In groups of columns that fit on the page, each with the names of its rows."""
    cell, head = _CELL, _HEAD
    widths = _widths(table, cell, head)
    if not is_words and sum(widths) > paper.width:
        cell, head = _TIGHT, _TIGHT_HEAD
        widths = _widths(table, cell, head)
    if is_words:
        widths = _squeezed(table, cell, head, widths, paper.width)
        groups = [list(range(len(table.heads)))]
    else:
        most = max(1.0, sum(widths[: table.labels]) / (_NAMES * paper.width))
        widths = [w / most if i < table.labels else w for i, w in enumerate(widths)]
        groups = columns_that_fit(widths, table.labels, paper.width)
    for group in groups:
        _columns(paper, table, group, widths, (cell, head), is_words)
    if table.note:
        _text(paper, table.note, SMALL)


def _columns(
    paper: Paper,
    table: CellTable,
    group: Sequence[int],
    widths: Sequence[float],
    faces: tuple[Face, Face],
    is_words: bool,
) -> None:
    """One group of columns, the heads again on each page."""
    cell, head = faces
    left = set(group) if is_words else set(range(table.labels))
    heads = [table.heads[i] for i in group]
    some = [widths[i] for i in group]
    flush = [i in left for i in group]
    rows = [[row[i] for i in group] for row in table.rows]
    paper.need(_row_height(heads, some, head) + 3 * cell.leading)
    _row(paper, heads, some, head, flush)
    for row in rows:
        if paper.need(_row_height(row, some, cell)):
            _row(paper, heads, some, head, flush)
        _row(paper, row, some, cell, flush)
    paper.skip(8)


def _row(
    paper: Paper, texts: Sequence[str], widths: Sequence[float], face: Face, flush: Sequence[bool]
) -> None:
    """Texts side by side, names flush left and numbers flush right, a rule below."""
    top, height, x = paper.y, _row_height(texts, widths, face), 0.0
    for text, width, is_left in zip(texts, widths, flush, strict=True):
        lines = list(broken(text, face, width - _GAP))
        for number, line in enumerate(lines):
            paper.y = top - number * face.leading
            room = 0.0 if is_left else width - _GAP - width_of(line, face)
            paper.line(line, face, x + room)
        x += width
    paper.y = top - height + 1.5
    paper.rule(0, sum(widths))
    paper.y = top - height


def _row_height(texts: Sequence[str], widths: Sequence[float], face: Face) -> float:
    lines = [
        len(list(broken(text, face, width - _GAP)))
        for text, width in zip(texts, widths, strict=True)
    ]
    return max(lines, default=1) * face.leading + 3


def _widths(table: CellTable, cell: Face, head: Face) -> list[float]:
    """Each column as wide as its widest cell, or the longest word of its head."""
    return [
        _GAP
        + max(
            max((width_of(" ".join(words_of(row[i])), cell) for row in table.rows), default=0.0),
            _longest(text, head),
        )
        for i, text in enumerate(table.heads)
    ]


def _squeezed(
    table: CellTable, cell: Face, head: Face, widths: Sequence[float], room: float
) -> list[float]:
    """Columns of words share the room: each its longest word, and of the rest by their need."""
    if sum(widths) <= room:
        return list(widths)
    least = [
        _GAP + max([_longest(title, head), *(_longest(row[i], cell) for row in table.rows)])
        for i, title in enumerate(table.heads)
    ]
    if sum(least) >= room:
        return [room * width / sum(least) for width in least]
    wish = [max(0.0, width - small) for width, small in zip(widths, least, strict=True)]
    spare = room - sum(least)
    return [small + spare * more / sum(wish) for small, more in zip(least, wish, strict=True)]


def _longest(text: str, face: Face) -> float:
    return max((width_of(word, face) for word in words_of(text)), default=0.0)
