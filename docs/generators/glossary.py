"""The glossary: words of the program and words of reports, from the files that reports read."""

from __future__ import annotations

from dva_sim.experiments.report.glossary import TERMS
from generators.markdown import page as page_of
from generators.markdown import prose, sentence, table

_HEAD = """\
Each word has one meaning. A report links the words that it uses to the same explanations."""


def page() -> str:
    """Return the page in Markdown."""
    rows = sorted(([prose(t.name), sentence(t.means)] for t in TERMS), key=lambda r: r[0].lower())
    return page_of("Glossary", _HEAD, table(["word", "meaning"], rows))
