"""The page of evidence: each model beside what is known, from the table that was kept last."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import groupby

from dva_sim.agents.operator.published import (
    blind_lines,
    load_history,
    load_split,
    load_targets,
    target_lines,
)
from dva_sim.validation.evidence import (
    SUBJECTS,
    Evidence,
    Subject,
    headline,
    passes,
    read_evidence,
)
from dva_sim.validation.evidence_page import LONG, TITLES, ResultSheet, make_sheets
from dva_sim.validation.figure import draw
from generators.markdown import ROOT, code, prose, table
from generators.markdown import page as page_of

KEPT = ROOT / "docs/generators/evidence.csv"
"""Table that `dva-sim validate` wrote, with the lines of all subjects."""
_HEAD = """\
Each line is a claim of a model beside a value from outside the simulation: exact by theory,
published, or measured. A band around that value has to hold the prediction. For single runs under
loss and for middleware a band around the prediction has to hold what was measured. The lines of
*Rule* say what all others have to come to; lines that are shown only count nowhere.
[Validation](validation.md) explains how lines are judged, and what had been seen before.
`dva-sim validate` prints the same tables."""
_COMPARED = """\
Each comparison is one of the persons of its day. Lines are blind in their first comparison at most,
and only if nothing had been seen of their publication; those counts alone test the persons on
unseen data. `operators-split.yaml` has the roles, and `operators-history.csv` each value."""
PICTURE = "explanation/evidence.svg"
_PICTURE = "![Measured beside predicted, with a panel for each subject](evidence.svg)"
_READING = f"""\
Each mark of the figure is a line with a verdict: its prediction over what was measured, so that 1
is right, and in grey its band in the same ratio. Triangles lie beyond the edge; black marks miss.
Of groups with more than {LONG} lines the tables below show those that do not hold."""


def page() -> str:
    """Return the page in Markdown."""
    subjects = kept()
    fail = [TITLES[subject] for subject, lines in subjects.items() if not passes(lines)]
    state = f"{len(fail)} of {len(subjects)} rules fail: {', '.join(fail)}."
    heads = (
        f"- **{TITLES[subject]}**: {prose(headline(lines))}" for subject, lines in subjects.items()
    )
    blocks = [f"**{state if fail else 'All rules hold.'}**", "\n".join(heads)]
    blocks += [_HEAD, _PICTURE, _READING]
    for subject, lines in subjects.items():
        blocks += _subject(TITLES[subject], lines)
        if subject == "operators":
            blocks += _comparisons()
    return page_of("Evidence", *blocks)


def picture() -> bytes:
    """Return the figure of all kept lines."""
    return draw([line for lines in kept().values() for line in lines]).svg


@cache
def kept() -> dict[Subject, list[Evidence]]:
    """Return the kept lines of each subject."""
    lines = read_evidence(KEPT)
    return {subject: [e for e in lines if e.subject == subject] for subject in SUBJECTS}


def _comparisons() -> Iterator[str]:
    """Yield what earlier comparisons of the operators were, and how many lines held in each."""
    split = load_split()
    history = load_history()
    lines = target_lines(load_targets(), split)
    blind = blind_lines(lines, split, history)
    rows = []
    for name, comparison in split.comparisons.items():
        verdicts = [
            line.holds(history[line.id][name])
            for line in lines
            if line.kind == "not-fitted" and name in history.get(line.id, ())
        ]
        held, count = blind.get(name, (0, 0))
        unseen = f"{held} of {count}" if count else "none"
        day = comparison.day.isoformat()
        rows.append((name, day, comparison.seen, f"{sum(verdicts)} of {len(verdicts)}", unseen))
    yield "### Operators: comparisons so far"
    yield _COMPARED
    yield table(("comparison", "day", "seen before it", "not fitted to, held", "blind, held"), rows)


def _subject(title: str, lines: Sequence[Evidence]) -> Iterator[str]:
    """Yield the rule of a subject, and its lines group by group."""
    yield f"## {title}"
    *groups, rule = make_sheets(lines, LONG)
    for sheet in (rule, *groups):
        if sheet.rows or sheet.text:
            yield f"### {prose(sheet.title)}"
            yield sheet.text
            yield from _tables(sheet)


def _tables(sheet: ResultSheet) -> Iterator[str]:
    """Yield each source of a group, and a table of the lines that it holds for."""
    for is_source, rows in groupby(sheet.rows, lambda row: len(row) == 1):
        if is_source:
            yield from (prose(text) for (text,) in rows)
        else:
            yield table(sheet.heads, ([code(row[0]), *map(prose, row[1:])] for row in rows))
