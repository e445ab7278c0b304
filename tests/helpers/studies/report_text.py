"""Visible text of a report."""

import html
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.layout_engine import ConstrainedLayoutEngine

from dva_sim.experiments.report.report import write_report

_INLINE = r"</?(?:a|b|dfn|span)\b[^>]*>"


def words(report: Path) -> str:
    """The page without styles and pictures; what is folded away is there too."""
    page = re.sub(r"<style>.*?</style>", "", report.read_text(encoding="utf-8"), flags=re.S)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", re.sub(_INLINE, "", page))).split())


@contextmanager
def blank_pictures() -> Iterator[None]:
    """Figures are computed and have captions and numbers, but their pictures are left blank.

    To lay out and paint them is four fifths of what a report costs.
    """
    with (
        mock.patch.object(ConstrainedLayoutEngine, "execute"),
        mock.patch.object(FigureCanvasAgg, "print_png", lambda _, file, **__: file.write(b"png")),
        mock.patch.object(FigureCanvasSVG, "print_svg", lambda _, file, **__: file.write(b"svg")),
    ):
        yield


def words_of(folder: Path, **options: Any) -> str:
    """The words of a report on results, written with blank pictures."""
    with blank_pictures():
        return words(write_report(folder, **options))


def visible_words(report: Path) -> int:
    """Number of words of the page that a reader sees before unfolding anything."""
    page = re.sub(r"<(style|title)>.*?</\1>", "", report.read_text(encoding="utf-8"), flags=re.S)
    inner = r"(?:(?!<details).)*?"
    folded = rf"<details[^>]*>\s*(<summary>{inner}</summary>){inner}</details>"
    while (shorter := re.sub(folded, r"\1", page, flags=re.S)) != page:
        page = shorter
    return len(html.unescape(re.sub(r"<[^>]+>", " ", re.sub(_INLINE, "", page))).split())
