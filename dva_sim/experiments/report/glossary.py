"""The glossary: words that not every reader knows, of reports and of the documentation.

The list at the foot of a report holds only the words that occur in it. The documentation lists all
of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.network.patterns import PATTERNS, Pattern, meaning_of


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


def _called(kind: type[Pattern]) -> str:
    """Either of a pattern's names, the longer one first."""
    return rf"\b(?:{re.escape(kind.title)}|{re.escape(kind.label)})"


def _all() -> Iterator[Term]:
    """Patterns by either of their names, and what stands in `words.yaml`."""
    for kind in PATTERNS.values():
        yield Term(kind.title, meaning_of(kind), _called(kind))
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
