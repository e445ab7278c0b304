"""Building blocks of a report, in order, set by both the page and the printed document."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
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
    """Words and what they mean; `key` is where a link to one leads."""

    entries: tuple[tuple[str, str, str], ...]


@dataclass(frozen=True)
class Folded:
    """Background: folded away on the page, in full in print."""

    title: str
    blocks: tuple[Block, ...]


Block = Heading | Words | First | Items | Printed | FigureBlock | Verbatim | Terms | Folded


def texts_of(blocks: Iterable[Block]) -> list[str]:
    """All that is said in sentences, and the heads of tables, in order."""
    found: list[str] = []

    def note(text: str) -> str:
        found.append(text)
        return text

    reworded(blocks, note)
    return found


def reworded(blocks: Iterable[Block], change: Callable[[str], str]) -> list[Block]:
    """Return the blocks with every text changed, in reading order."""
    return [_reworded(block, change) for block in blocks]


def _reworded(block: Block, change: Callable[[str], str]) -> Block:
    if isinstance(block, Words):
        return replace(block, text=change(block.text))
    if isinstance(block, First):
        lead, figure = change(block.lead), block.figure and _captioned(block.figure, change)
        depends = tuple((about, change(words)) for about, words in block.depends)
        return First(lead, figure, depends)
    if isinstance(block, Items):
        return Items(tuple(map(change, block.items)))
    if isinstance(block, Printed):
        heads, note = list(map(change, block.table.heads)), change(block.table.note)
        return replace(block, table=replace(block.table, heads=heads, note=note))
    if isinstance(block, FigureBlock):
        return FigureBlock(_captioned(block.figure, change))
    if isinstance(block, Folded):
        return replace(block, blocks=tuple(reworded(block.blocks, change)))
    return block


def _captioned(figure: Drawn, change: Callable[[str], str]) -> Drawn:
    return replace(figure, caption=change(figure.caption))
