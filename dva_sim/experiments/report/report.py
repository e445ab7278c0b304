"""The sections of a report in their order: question and answer first, evidence, then method.

One page that answers a study: self-contained, and the same bytes whenever it is made again.
"""

from __future__ import annotations

import base64
import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dva_sim.experiments.analysis.answer import too_few
from dva_sim.experiments.analysis.conditions import conditions
from dva_sim.experiments.analysis.predictions import Judged, judge_all
from dva_sim.experiments.analysis.study_view import factors_of, keys_of
from dva_sim.experiments.execution.checkpoint import load_so_far
from dva_sim.experiments.report.answer_conditions import repeated
from dva_sim.experiments.report.answer_table import answer_table, spread_table
from dva_sim.experiments.report.blocks import (
    Block,
    FigureBlock,
    First,
    Folded,
    Heading,
    Items,
    Printed,
    Terms,
    Verbatim,
    Words,
    terms_in,
    texts_of,
)
from dva_sim.experiments.report.cell_table import CellTable, tuned_table
from dva_sim.experiments.report.choice_table import beside_table, choice_table
from dva_sim.experiments.report.figures.registry import draw_all
from dva_sim.experiments.report.figures.style import Drawn
from dva_sim.experiments.report.hypothesis_tables import (
    comparison_table,
    hypothesis_table,
    registration_table,
)
from dva_sim.experiments.report.method import remarks, timeout_remark
from dva_sim.experiments.report.outcome_table import in_a_line
from dva_sim.experiments.report.outcome_table import sentences as sentences_of_endings
from dva_sim.experiments.report.outcome_table import table as endings_table
from dva_sim.experiments.report.printing import print_page
from dva_sim.experiments.report.prose import note
from dva_sim.experiments.report.study_size import not_reached, plan_table, size_of
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.manifest import status_of
from dva_sim.experiments.study.parts import POINT
from dva_sim.experiments.study.study import Status
from dva_sim.kernel.errors import DvaSimError
from dva_sim.kernel.labels import HIDDEN
from dva_sim.kernel.whole_files import whole, write_whole
from dva_sim.kernel.wording import capital, first_and_rest, listing, number
from dva_sim.simulation.labels import factor_name, is_in_file, level_name, setting, with_unit

if TYPE_CHECKING:
    import jinja2


WORDS = "Words"
_KINDS = {
    "confirmatory": "Confirmatory: registered before the run",
    "declared": "Declared in the study's file, not registered before the run",
    "exploratory": "Exploratory: not a test of what it found",
}


def blocks_of(reading: Reading, drawn: Sequence[Drawn]) -> list[Block]:
    """Return the whole report below its title.

    Args:
        reading: The results.
        drawn: The figures; the first is the one that answers.
    """
    answer = reading.answer
    blocks = list(
        chain(
            _status(reading),
            [First(answer.lead, drawn[0] if drawn else None, tuple(answer.depends.items()))],
            _events(reading),
            _claims(reading),
            _comparisons(reading),
            _endings(reading),
            _found(reading),
            _what_varied(reading),
            _figures(reading, drawn[1:]),
            _tables(reading),
            _needed(reading),
            _method(reading),
        )
    )
    text = json.dumps(reading.manifest, indent=2, sort_keys=True, ensure_ascii=False)
    manifest = Folded("Manifest: all that was asked, and by which program", (Verbatim(text),))
    return [*blocks, *_words(blocks), manifest]


def _status(reading: Reading) -> Iterator[Block]:
    if reading.results.partial:
        yield Words(reading.results.partial, "banner")
    status = status_of(reading.manifest)
    if missed := not_reached(reading):
        yield Words(missed, "warning")
    yield Words(size_of(reading), "note")
    yield Words(_KINDS[status.kind], "caution" if status.kind == "exploratory" else "label")
    if status.why:
        yield Words(f"Why: {'; '.join(status.why)}.", "note")
    for warning in reading.warnings:
        yield Words(warning, "warning")


def _events(reading: Reading) -> Iterator[Block]:
    """Yield the line on event outcomes, unless it is already among the warnings."""
    if reading.events is not None and not reading.events.warns:
        yield Words(str(reading.events), "note")


def _claims(reading: Reading) -> Iterator[Block]:
    status = status_of(reading.manifest)
    hypotheses = reading.judgement.tested
    if hypotheses:
        yield Heading(_whose_claims(status))
        yield Printed(hypothesis_table(hypotheses, reading.cluster), is_words=True)
    if status.registration:
        if status.kind != "confirmatory":
            yield Words("This run is not the one that was registered: it settles nothing.", "note")
        registered = registration_table(reading.manifest, reading.runs, reading.persons)
        yield Folded("The registration, and what was run", (Printed(registered, is_words=True),))
    predictions = judge_all(reading.study, reading.view)
    if predictions:
        title = "Predictions made before the run"
        counts = Counter(p.verdict for p in predictions)
        verdicts = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
        table = Printed(_prediction_table(predictions, reading.cluster), is_words=True)
        if not hypotheses:
            yield Heading(title)
        yield Folded(f"{title}: {verdicts}" if hypotheses else capital(verdicts), (table,))


def _whose_claims(status: Status) -> str:
    if status.kind == "confirmatory":
        return "Registered hypotheses"
    return (
        "Hypotheses, not run as registered" if status.registration else "Hypotheses, not registered"
    )


def _prediction_table(predictions: Sequence[Judged], cluster: str) -> CellTable:
    heads = ["predicted", "of the contrast", "found (95 % interval)", "verdict"]
    few = [f": {too_few(p.persons, cluster)}" * (p.verdict == "open") for p in predictions]
    rows = [
        [p.text, p.expected, p.found, f"{p.verdict}{why}"]
        for p, why in zip(predictions, few, strict=True)
    ]
    return CellTable("", heads, len(heads), rows)


def _comparisons(reading: Reading) -> Iterator[Block]:
    if reading.judgement.compared:
        table = comparison_table(reading.judgement, reading.cluster)
        yield Folded("Named comparisons", (Printed(table, is_words=True),))


def _endings(reading: Reading) -> Iterator[Block]:
    """Yield the table of outcomes if some runs went wrong.

    If all went well, yield a line about that, unless the answer has one.
    """
    endings = reading.endings
    view = reading.view
    if endings is None or view is None:
        return
    if endings.is_right.all():
        if reading.finding is None or not reading.finding.missed:
            yield Words(in_a_line(endings, view.part.name, len(reading.results.failures)))
        return
    yield Heading(f"How it ended, in part {view.part.name}")
    for sentence in sentences_of_endings(endings, view, reading.finding):
        yield Words(sentence)
    shares = endings_table(endings, view, reading.cluster)
    if shares.rows:
        yield Folded(f"The shares of all {len(shares.rows)} configurations", (Printed(shares),))


def _found(reading: Reading) -> Iterator[Block]:
    """Yield the answer level by level, further results, and what other models of persons say."""
    if reading.map is not None and reading.view is not None:
        yield Heading("The map")
        part = reading.view.part.name
        yield Printed(choice_table(reading.map, part), is_words=True)
        yield Folded("What drives are like", (Printed(beside_table(reading.map, part)),))
    table = answer_table(reading)
    blocks: list[Block] = [Printed(table)] if table is not None else []
    numbers = [*blocks, *map(Words, reading.answer.notes)]
    if reading.map is not None and numbers:
        yield Folded("One pair of choices in numbers", tuple(numbers))
    elif numbers:
        yield Heading("The answer in numbers")
        yield from numbers
    if reading.robustness is not None:
        yield Heading("Under other models of the persons")
        yield from map(Words, repeated(reading.robustness))


def _what_varied(reading: Reading) -> Iterator[Block]:
    """Yield the varied factors, before the figures, which use their names."""
    factors = [f for f in factors_of(reading.study) if f.name != POINT]
    design = reading.study.get("design") or {}
    lines = [f"{factor_name(f.name)} ({_levels(f.name, f.levels)})" for f in factors]
    ranges = design.get("ranges") or {}
    lines += [
        f"{with_unit(k)} from {number(r['low'])} to {number(r['high'])}" for k, r in ranges.items()
    ]
    if lines:
        names = [f"{factor_name(f.name)} ({len(f.levels)})" for f in factors]
        names += [with_unit(name) for name in ranges]
        levels = Words(f"{capital(_how(design, len(factors)))}: {'; '.join(lines)}.")
        changes = tuple(
            f"{level_name(factor, level)}: {setting(changes) or 'nothing'}"
            for factor, named in reading.study.get("treatments", {}).items()
            for level, changes in named.items()
        )
        yield Heading("What was varied")
        yield Folded(
            f"Levels of {listing(names)}", (levels, Items(changes)) if changes else (levels,)
        )


def _how(design: Mapping[str, Any], factors: int) -> str:
    """Describe how levels were combined."""
    if design.get("zip"):
        return f"{listing([factor_name(n) for n in design['zip']])} taken together"
    if design.get("rows") or design.get("csv"):
        return "as listed row by row"
    for kind, words in _SAMPLED.items():
        if design.get(kind):
            crossed = ", each with every combination of levels" if factors else ""
            return f"at points {words}{crossed}"
    return "in every combination" if factors > 1 else "alone"


_SAMPLED = {
    "latin_hypercube": "that fill the ranges as a Latin hypercube",
    "sobol": "that fill the ranges as a Sobol' sequence",
    "saltelli": "that fill the ranges as Saltelli's sample",
}


def _figures(reading: Reading, drawn: Sequence[Drawn]) -> Iterator[Block]:
    """Yield all others than the one that answers; what several share is said once."""
    if not drawn or reading.view is None:
        return
    yield Heading("Figures")
    reads = dict.fromkeys(chain.from_iterable(figure.reads for figure in drawn))
    part = f"All are of part {reading.view.part.name} unless the title names another one."
    yield Words(part)
    if reads:
        yield Folded("How to read the figures", (Words(" ".join(reads)),))
    yield from map(FigureBlock, drawn)


def _tables(reading: Reading) -> Iterator[Block]:
    if reading.by_people:
        for table in reading.cells:
            yield Heading(table.part)
            yield Printed(table)
        return
    yield Heading("Every configuration")
    if not reading.cells:
        yield Words("No run was completed.")
    for table in reading.cells:
        if table.empty:
            some = f"{table.empty} of {len(table.rows)} configurations have no run"
            yield Words(f"Part {table.part}: {some}.", "warning")
        title = f"Part {table.part}: {len(table.rows)} configurations"
        yield Folded(title, (Printed(table),))
    if tuned := tuned_table(reading.manifest):
        yield Heading("Tuning")
        whose = " and ".join(tuned.heads[: tuned.labels])
        what = tuned.heads[tuned.labels]
        yield Words(
            f"Each {whose} has a {what} that suits it best, so for each the same number of values "
            "was tried. Both tuned and untuned configurations are above."
        )
        yield Printed(tuned)


def _needed(reading: Reading) -> Iterator[Block]:
    if reading.plans:
        table = plan_table(reading.plans, reading.cluster)
        yield Folded(f"How many {reading.cluster}s it would take", (Printed(table, is_words=True),))


def _method(reading: Reading) -> Iterator[Block]:
    yield Heading("Method")
    yield Folded("How it was run and analysed", (Items(tuple(remarks(reading))),))
    scenarios = reading.scenarios
    study = reading.study
    of_model = reading.page.conditions if reading.view else conditions
    parts = study.get("parts", {}).values()
    changed = dict.fromkeys(key for part in parts for key in part.get("changes") or {})
    if stated := of_model(scenarios, keys_of(study), list(changed)):
        rows = [[name, *values] for name, values in stated]
        settings = Printed(CellTable("", ["setting", *scenarios], 1, rows))
        remark = timeout_remark(scenarios, study)
        yield Folded("All settings", (settings, *([Words(remark)] if remark else [])))
    if spread := spread_table(reading.view) if reading.view else None:
        yield Folded("Between and within persons", (Words(note("persons")), Printed(spread)))


def _words(blocks: Sequence[Block]) -> Iterator[Block]:
    """Yield the glossary of the terms used in the report."""
    if terms := terms_in(texts_of(blocks)):
        yield Heading(WORDS)
        entries = tuple((term.name, f"{term.means}.") for term in terms)
        yield Folded(f"What {len(terms)} words in this report mean", (Terms(entries),))


def _levels(name: str, levels: Sequence[Any]) -> str:
    return listing([_in_full(name, level) for level in levels])


def _in_full(name: str, level: Any) -> str:
    """Return a level with the file it is from, if it is a class in one."""
    file = f" ({level.rpartition(':')[0]})" if is_in_file(level) else ""
    return level_name(name, level) + file


PAGE = "report.html"
PAPER = "report.pdf"
FIGURES = "figures"


def write_report(folder: Path, pdf: bool = False) -> Path:
    """Make `report.html` and `figures/` from a results folder.

    For an unfinished study, the page shows the results so far.

    Args:
        folder: Results folder.
        pdf: Print `report.pdf` too. One that is there already is printed again in any case, so
            that it never says something else than the page.

    Raises:
        ConfigError: the folder holds no results.
        DvaSimError: the disk is full or refuses to be written, or the page is there and no browser
            prints it.
    """
    return write_page(Reading(load_so_far(folder)), pdf)


def write_page(reading: Reading, pdf: bool = False) -> Path:
    """Make the report of results that have been analysed; see `write_report`."""
    folder = reading.results.folder
    drawn = draw_all(reading)
    blocks = blocks_of(reading, drawn)
    question = str(reading.study.get("question", "A study without a question"))
    page = folder / PAGE
    try:
        _write_figures(folder / FIGURES, drawn)
        write_whole(page, _page(question, blocks))
        if pdf or (folder / PAPER).exists():
            with whole(folder / PAPER) as part:
                print_page(page, part)
    except OSError as error:
        raise DvaSimError(
            f"the report cannot be written in {folder}: {error.strerror}; "
            f"fix that, then run 'dva-sim report {folder}'"
        ) from None
    return page


def _write_figures(folder: Path, drawn: Sequence[Drawn]) -> None:
    """Write each figure as vectors, pixels, and the numbers behind it; none of an old report."""
    folder.mkdir(exist_ok=True)
    made = {
        f"{figure.name}.{ending}": content
        for figure in drawn
        for ending, content in (("svg", figure.svg), ("png", figure.png), ("csv", figure.csv))
        if content
    }
    for stale in folder.iterdir():
        if stale.suffix in (".svg", ".png", ".csv") and stale.name not in made:
            stale.unlink()
    for name, content in made.items():
        write_whole(folder / name, content)


def _page(question: str, blocks: Sequence[Block]) -> str:
    """Fill the template."""
    sections = [block.text for block in blocks if isinstance(block, Heading) and block.level == 2]
    page = _template().render(question=question, blocks=blocks, sections=sections)
    return page.translate(HIDDEN)  # else a name might turn the text around it


def _template() -> jinja2.Template:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dva_sim.experiments.report"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {
        "data_uri": _data_uri,
        "kind": lambda block: type(block).__name__,
        "key": _key,
    }
    environment.filters["sentences"] = first_and_rest
    return environment.get_template("report.html.j2")


def _key(text: str) -> str:
    """Return a heading as an identifier."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def _data_uri(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
