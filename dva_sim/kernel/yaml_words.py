"""Mistakes in YAML in words for people who write configurations, at the line that is wrong."""

from __future__ import annotations

import re
from typing import Any, Final, NamedTuple

Place = tuple[int | None, int | None]


class Slip(NamedTuple):
    """Translation of a message of ruamel; and whether the mistake is where its context began."""

    theirs: str
    ours: str
    is_at_begin: bool = False


_WORDS: Final = (
    Slip(r"mapping values are not allowed here",
         "a second colon on the line, or a key indented differently from its neighbours; "
         "quote text that contains a colon"),
    Slip(r"expected ',' or '([\]}])'", "a bracket is not closed: {0} is missing", True),
    Slip(r"found character '\\t'", "a tab; indent with spaces"),
    Slip(r"found character '(.)' that cannot start any token",
         "a value cannot begin with {0}; put it in quotes"),
    Slip(r"found unexpected (?:end of stream|document separator)", "a quote is not closed", True),
    Slip(r"found duplicate key \"?(.*?)\"? with value", "key {0!r} appears twice"),
    Slip(r"found undefined alias '(.*)'", "*{0} refers to nothing; quote text that begins with *"),
    Slip(r"could not find expected ':'", "a key without a colon and a value", True),
    Slip(r"found unknown escape character '(.)'",
         "\\{0} means nothing within double quotes; use single ones"),
    Slip(r"expected <block end>, but found '(?:-|<block sequence start>)'",
         "a list item indented differently from its neighbours"),
    Slip(r"expected <block end>",
         "indented differently from its neighbours, or text after a value"),
    Slip(r"but found another document", "a second document; give each a file of its own"),
    Slip(r"(?:block )?sequence entries are not allowed", "a list item begins on a line of its own"),
    Slip(r"expected (?:'<document start>'|<document start>)", "text after the end of the document"),
    Slip(r"found unhashable key", "a key is text or a number, not a list or a mapping"),
)  # fmt: skip
_THEIRS: Final = r"(found|expected|could|but|did|while) "  # what is not of our own constructor
_SIGNS: Final = {
    "'<stream end>'": "the end of the file",
    "<block end>": "the end of a block",
    "'<scalar>'": "a value",
    "'?'": "?",
}


def in_words(error: Any) -> tuple[str, Place]:
    """Return what is wrong, and its line and column, from 1.

    Args:
        error: Exception raised by ruamel, with its marks.
    """
    problem = str(error.problem or "").split("\n")[0]
    for entry in _WORDS:
        if found := re.search(entry.theirs, problem):
            mark = error.context_mark if entry.is_at_begin else None
            return entry.ours.format(*found.groups()), _place(mark or error.problem_mark)
    for sign, word in _SIGNS.items():
        problem = problem.replace(sign, word)
    if not problem or re.match(_THEIRS, problem):
        problem = f"is not valid YAML: {problem}".removesuffix(": ")
    return problem, _place(error.problem_mark or error.context_mark)


def _place(mark: Any) -> Place:
    return (mark.line + 1, mark.column + 1) if mark else (None, None)
