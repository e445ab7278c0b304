"""The glossary: words of the program and words of reports, from the file that reports read."""

from __future__ import annotations

from dva_sim.experiments.report.blocks import GLOSSARY
from generators.markdown import page as page_of
from generators.markdown import prose, sentence, table

_HEAD = """\
Each word has one meaning. Reports link the words that they use to the same explanations."""


def page() -> str:
    """Return the page in Markdown."""
    terms = sorted(GLOSSARY, key=lambda term: term.name.lower())
    rows = ([prose(term.name), sentence(term.means)] for term in terms)
    return page_of("Glossary", _HEAD, table(["word", "meaning"], rows))
