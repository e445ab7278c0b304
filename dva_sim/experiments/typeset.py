"""Pages of text, tables and figures as PDF, by matplotlib alone: no system libraries."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dva_sim.experiments.figures.palette import FAINT, INK, SOFT

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
