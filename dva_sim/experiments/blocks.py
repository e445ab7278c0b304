"""What a report is made of: blocks in order, which a page and a printed document both set."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from dva_sim.experiments.cells import CellTable

if TYPE_CHECKING:
    from dva_sim.experiments.figures.style import Drawn

Kind = Literal["plain", "note", "warning", "label"]


@dataclass(frozen=True)
class Heading:
    """A title within the report.

    Attributes:
        text: In words.
        level: 2 for a section, 3 for what is below it.
    """

    text: str
    level: int = 2


@dataclass(frozen=True)
class Words:
    """A paragraph.

    Attributes:
        text: In words.
        kind: How loud it is said.
    """

    text: str
    kind: Kind = "plain"


@dataclass(frozen=True)
class Box:
    """The answer, set apart: the first paragraph is the lead."""

    paragraphs: tuple[str, ...]


@dataclass(frozen=True)
class Items:
    """A list of remarks."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Printed:
    """A table.

    Attributes:
        table: Its heads and rows.
        is_words: Whether its cells are sentences rather than numbers.
    """

    table: CellTable
    is_words: bool = False


@dataclass(frozen=True)
class Shown:
    """A figure with its title and caption."""

    figure: Drawn


@dataclass(frozen=True)
class Verbatim:
    """Text to be kept as it is, folded away where that can be done."""

    title: str
    text: str


Block = Heading | Words | Box | Items | Printed | Shown | Verbatim
