"""Pages of text, tables and figures as PDF, by matplotlib alone: no system libraries.

The blocks of a report set on paper: A4 as PDF, figures as vectors, text that can be searched.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dva_sim.experiments.report.blocks import (
    Block,
    FigureBlock,
    First,
    Folded,
    Heading,
    Items,
    Kind,
    Printed,
    Terms,
    Verbatim,
    Words,
    reworded,
    texts_of,
)
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.figures.palette import FAINT, INK, SOFT, WARNING
from dva_sim.experiments.report.glossary import RING, Marker, terms_in

if TYPE_CHECKING:
    from matplotlib.figure import Figure


A4 = (595.28, 841.89)  # [pt]
MARGIN = 45.0  # [pt]
FOOT = 30.0  # from the lower edge to the page's number [pt]
LEADING = 1.32  # line to line, in sizes of the font
_INCH = 72.0  # [pt]
_DATE = datetime(2000, 1, 1, tzinfo=UTC)
_ROUNDING = 0.01  # [pt]


@dataclass(frozen=True)
class Face:
    """How text looks.

    Attributes:
        size: Of the font [pt].
        weight: `normal` or `bold`.
        family: `DejaVu Sans`, or its monospaced sister.
        colour: Of the text.
    """

    size: float = 9.0
    weight: str = "normal"
    family: str = "DejaVu Sans"
    colour: str = INK

    @property
    def leading(self) -> float:
        """From line to line [pt]."""
        return LEADING * self.size


SMALL = Face(7.5, colour=SOFT)


class Paper:
    """Pages that fill from the top down; a new one begins when there is no room.

    Args:
        path: Of the file.
        title: Kept in the file, and at the foot of each page.
    """

    def __init__(self, path: Path, title: str) -> None:
        from matplotlib.backends.backend_pdf import PdfFile

        # The date would differ from day to day: the file should not.
        facts = {
            "Title": title,
            "Creator": "dva-sim",
            "CreationDate": _DATE,
        }
        self._file: Any = PdfFile(str(path), metadata=facts)  # type: ignore[no-untyped-call]
        self._title, self._pages = title, 0
        self.y = 0.0
        self._turn()

    @property
    def width(self) -> float:
        """Of the column of text [pt]."""
        return A4[0] - 2 * MARGIN

    @property
    def height(self) -> float:
        """Of the column of text [pt]."""
        return A4[1] - 2 * MARGIN

    @property
    def room(self) -> float:
        """What is left of the page [pt]."""
        return self.y - MARGIN

    def need(self, height: float) -> bool:
        """Begin a new page unless there is room for `height` [pt]; whether one was begun."""
        if height <= self.room or self.y >= A4[1] - MARGIN:
            return False
        self._turn()
        return True

    def skip(self, height: float) -> None:
        """Leave some room, but none at the top of a page."""
        if self.y < A4[1] - MARGIN:
            self.y -= height

    def line(self, text: str, face: Face, x: float = 0.0) -> None:
        """One line at the present height, `x` from the left margin; the height stays."""
        from matplotlib.colors import to_rgba

        context = self._renderer.new_gc()
        context.set_foreground(to_rgba(face.colour), isRGBA=True)
        where = MARGIN + x, self.y - face.size
        self._renderer.draw_text(context, *where, text, _font(face), 0)

    def rule(self, x: float = 0.0, width: float | None = None) -> None:
        """A thin line across the column, at the present height."""
        from matplotlib.path import Path as Outline
        from matplotlib.transforms import IdentityTransform

        context = self._renderer.new_gc()
        context.set_foreground(FAINT)
        context.set_linewidth(0.5)
        ends = [(MARGIN + x, self.y), (MARGIN + x + (width or self.width - x), self.y)]
        self._renderer.draw_path(context, Outline(ends), IdentityTransform())

    def place(self, figure: Figure, width: float, height: float) -> None:
        """A figure as vectors, scaled to that size [pt], below the present height."""
        from matplotlib.backends.backend_mixed import MixedModeRenderer
        from matplotlib.backends.backend_pdf import Op, RendererPdf

        wide, high = (float(side) for side in figure.get_size_inches())
        dots, scale, file = figure.dpi, width / (_INCH * wide), self._file
        page, figure.dpi = (file.width, file.height), _INCH
        file.width, file.height = wide, high  # marks beyond would be left out
        file.output(Op.gsave)
        file.output(scale, 0, 0, scale, MARGIN, self.y - height, Op.concat_matrix)
        own = RendererPdf(file, _DOTS, high, wide)  # type: ignore[no-untyped-call]
        renderer: Any = MixedModeRenderer(figure, wide, high, _DOTS, own)  # type: ignore[no-untyped-call]
        figure.draw(renderer)
        renderer.finalize()
        file.output(Op.grestore)
        (file.width, file.height), figure.dpi = page, dots
        self.y -= height

    def close(self) -> None:
        """End the file."""
        self._end_page()
        self._file.finalize()
        self._file.close()

    def _turn(self) -> None:
        from matplotlib.backends.backend_pdf import RendererPdf

        if self._pages:
            self._end_page()
        width, height = (side / _INCH for side in A4)
        self._file.newPage(width, height)
        self._renderer: Any = RendererPdf(self._file, _DOTS, height, width)  # type: ignore[no-untyped-call]
        self._pages += 1
        self.y = A4[1] - MARGIN

    def _end_page(self) -> None:
        self.y = FOOT
        number = str(self._pages)
        self.line(shortened(self._title, SMALL, self.width - 40), SMALL)
        self.line(number, SMALL, self.width - width_of(number, SMALL))
        self._renderer.finalize()
        self._file.endStream()


_DOTS = 200  # per inch, of what is drawn as pixels: crowds of dots


def width_of(text: str, face: Face) -> float:
    """How wide a line is [pt]."""
    return _width(text, face.size, face.weight, face.family)


def broken(text: str, face: Face, width: float) -> Iterator[str]:
    """A text in lines no wider than `width` [pt]; words that are wider are cut."""
    space, line, used = width_of(" ", face), "", 0.0
    for word in (piece for long in words_of(text) for piece in _cut(long, face, width)):
        size = width_of(word, face)
        if line and used + space + size > width + _ROUNDING:
            yield line
            line, used = word, size
        else:
            line, used = f"{line} {word}" if line else word, used + (space if line else 0) + size
    if line:
        yield line


def words_of(text: str) -> list[str]:
    """What a line may be broken between; a space that does not break is no such place."""
    return [word for word in re.split(r"[ \n\t]+", text) if word]


def shortened(text: str, face: Face, width: float) -> str:
    """The first line of a text, with dots where it goes on."""
    lines = list(broken(text, face, width))
    return lines[0] + (" ..." if len(lines) > 1 else "") if lines else ""


def _cut(word: str, face: Face, width: float) -> Iterator[str]:
    while word and width_of(word, face) > width + _ROUNDING:
        fits = next(
            (n for n in range(len(word) - 1, 1, -1) if width_of(word[:n], face) <= width), 1
        )
        yield word[:fits]
        word = word[fits:]
    yield word


@lru_cache(maxsize=20_000)
def _width(text: str, size: float, weight: str, family: str) -> float:
    from matplotlib.textpath import text_to_path

    wide: float = text_to_path.get_text_width_height_descent(
        text, _font(Face(size, weight, family)), ismath=False
    )[0]
    return wide


@lru_cache(maxsize=100)
def _font(face: Face) -> Any:
    from matplotlib.font_manager import FontProperties

    return FontProperties(family=face.family, weight=face.weight, size=face.size)


def columns_that_fit(widths: Sequence[float], labels: int, room: float) -> list[list[int]]:
    """Columns in as many groups as it takes, each with the leading ones that name its rows."""
    named = list(range(labels))
    used = sum(widths[:labels])
    groups, group, size = [], list(named), used
    for column in range(labels, len(widths)):
        if len(group) > labels and size + widths[column] > room:
            groups.append(group)
            group, size = list(named), used
        group.append(column)
        size += widths[column]
    return [*groups, group]


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
    _SETTERS[type(block)](paper, block)


def _words(paper: Paper, block: Words) -> None:
    _text(paper, block.text, _KINDS[block.kind])


def _folded(paper: Paper, block: Folded) -> None:
    _heading(paper, Heading(block.title, 3))
    for inner in block.blocks:
        _set(paper, inner)


def _items(paper: Paper, block: Items) -> None:
    for item in block.items:
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
        _figure(paper, FigureBlock(block.figure), _ANSWERING)
    if block.depends:
        _heading(paper, Heading("What this depends on", 3))
        _items(paper, Items(tuple(f"{about}: {words}" for about, words in block.depends)))


def _figure(paper: Paper, block: FigureBlock, most: float = math.inf) -> None:
    """Title, figure and caption on one page; smaller where it is too high for that."""
    drawn = block.figure
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
def _table(paper: Paper, block: Printed) -> None:
    """In groups of columns that fit on the page, each with the names of its rows."""
    table, is_words, cell, head = block.table, block.is_words, _CELL, _HEAD
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


_SETTERS: dict[type, Callable[[Paper, Any], None]] = {
    Heading: _heading,
    Words: _words,
    First: _first,
    Items: _items,
    Printed: _table,
    FigureBlock: _figure,
    Verbatim: _verbatim,
    Terms: _terms,
    Folded: _folded,
}
