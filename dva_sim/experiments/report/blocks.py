"""Building blocks of a report, in order, set by both the page and the printed document."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from dva_sim.experiments.report.cell_table import CellTable

if TYPE_CHECKING:
    from dva_sim.experiments.report.figures.style import Drawn


Kind = Literal["plain", "note", "warning", "label", "caution", "banner"]


@dataclass(frozen=True)
class Heading:
    """A title within the report.

    Attributes:
        text: Text in words.
        level: 2 for a section, 3 for what is below it.
    """

    text: str
    level: int = 2


@dataclass(frozen=True)
class Words:
    """A paragraph.

    Attributes:
        text: Text in words.
        kind: Emphasis; a banner precedes everything else.
    """

    text: str
    kind: Kind = "plain"


@dataclass(frozen=True)
class First:
    """Content of the first screen, and of the first printed page.

    Attributes:
        lead: The answer.
        figure: Figure that shows the answer.
        depends: Conditions of the answer: pairs of subject and sentence.
    """

    lead: str
    figure: Drawn | None = None
    depends: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Items:
    """A list of remarks."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Printed:
    """A table.

    Attributes:
        table: Its heads and rows.
        is_words: True if its cells are sentences rather than numbers.
    """

    table: CellTable
    is_words: bool = False


@dataclass(frozen=True)
class FigureBlock:
    """A figure with its title and caption."""

    figure: Drawn


@dataclass(frozen=True)
class Verbatim:
    """Text to be kept as it is."""

    text: str


@dataclass(frozen=True)
class Terms:
    """Words and what they mean."""

    entries: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Folded:
    """Background: folded away on the page, in full in print."""

    title: str
    blocks: tuple[Block, ...]


Block = Heading | Words | First | Items | Printed | FigureBlock | Verbatim | Terms | Folded


def texts_of(blocks: Iterable[Block]) -> Iterator[str]:
    """Yield all that is said in sentences, and the heads of tables, in order."""
    for block in blocks:
        match block:
            case Words(text=text):
                yield text
            case First(lead=lead, figure=figure, depends=depends):
                yield lead
                if figure is not None:
                    yield figure.caption
                yield from (words for _, words in depends)
            case Items(items=items):
                yield from items
            case Printed(table=table):
                yield from (*table.heads, table.note)
            case FigureBlock(figure=drawn):
                yield drawn.caption
            case Folded(blocks=inner):
                yield from texts_of(inner)
