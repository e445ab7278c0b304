"""Blocks that a page consists of, and the glossary of their words."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.network.patterns import PATTERNS, meaning_of

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
    """Preformatted text."""

    text: str


@dataclass(frozen=True)
class Terms:
    """Terms with their meanings."""

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


@dataclass(frozen=True)
class Term:
    """A word or phrase.

    Attributes:
        name: Term as the list has it.
        means: In one sentence, without its full stop.
        regex: Pattern of how it is said in a text, if otherwise than its name.
        in_reports: False for words that only the documentation explains.
    """

    name: str
    means: str
    regex: str = ""
    in_reports: bool = True

    @property
    def pattern(self) -> str:
        """Regular expression that matches the term."""
        return self.regex or rf"\b{re.escape(self.name)}\b"


def _all() -> Iterator[Term]:
    """Yield patterns under both of their names, and the terms of `words.yaml`."""
    for kind in PATTERNS.values():
        yield Term(
            kind.title, meaning_of(kind), f"\\b(?:{re.escape(kind.title)}|{re.escape(kind.label)})"
        )
    words = load_yaml(Path(__file__).with_name("words.yaml")).data
    for name, entry in words["reports"].items():
        yield Term(name, **entry) if isinstance(entry, dict) else Term(name, entry)
    for name, means in words["documentation"].items():
        yield Term(name, means, in_reports=False)


GLOSSARY = tuple(_all())
TERMS = tuple(term for term in GLOSSARY if term.in_reports)


def terms_in(texts: Iterable[str]) -> list[Term]:
    """Return the terms that occur anywhere, in the order of their names."""
    text = "\n".join(texts)
    return [
        term
        for term in sorted(TERMS, key=lambda term: term.name.lower())
        if re.search(term.pattern, text)
    ]
