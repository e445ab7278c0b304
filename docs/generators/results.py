"""The pages of results: what each shipped study answered, from the answers that are kept."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from dva_sim.cli.names import everything
from dva_sim.experiments.report.kept_answers import (
    HISTORY,
    KeptAnswer,
    Table,
    all_kept,
    read_manifest,
)
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import capital, first_and_rest, number
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.labels import factor_name, level_name, measure_name
from generators.markdown import ROOT, code, prose, shell, table
from generators.markdown import page as page_of

KEPT = ROOT / "experiments/answers"
REMARKS = ROOT / "docs/generators/remarks.yaml"
PICTURES = ROOT / "experiments/pictures"
_FIXED = (
    *("site.name", "robot.profile", "phone.profile", "operator.strategy", "operator.population"),
    "dispatch.policy",
)
"""Keys whose values a page of results names, unless the study varies them."""
_HEAD = """\
What the shipped studies answered, by which version and when. Each answer is kept in
`experiments/answers` with the manifest of its run. `dva-sim answers` compares that with the study
as it is now, repeats some of its runs, and reports answers that this version no longer gives.

*Declared* means run as the study's file says; *confirmatory* means registered before the run.
Intervals describe the simulated persons. They hold for real people as far as the models do:
[operators and assumptions](../explanation/operators.md) says how far that is."""
_HOW_TO_READ = (
    "What each choice costs beyond the best one on its link, from the least to the greatest over "
    'the models of the persons. "=": as good as the best; "?": too few drives to tell; "never": no '
    "run was finished in the time it had."
)


def paths() -> list[str]:
    """Return the paths of all pages of results."""
    return ["results/index.md", *(f"results/{name}.md" for name in questions())]


def pages() -> Iterator[tuple[str, str]]:
    """Yield the path and the text of the summary and of each study's page."""
    kept = {answer.study: answer for answer in all_kept(KEPT)}
    yield "results/index.md", _summary(kept)
    for name, question in questions().items():
        yield f"results/{name}.md", study_page(name, question, kept.get(name))


def study_page(name: str, question: str, answer: KeptAnswer | None, folder: Path = KEPT) -> str:
    """Return the page of a study in Markdown.

    Args:
        name: Name of the study.
        question: Its question.
        answer: Its kept answer, if there is one.
        folder: Folder of kept answers and their manifests.
    """
    blocks = _open(name) if answer is None else _answered(answer, folder)
    return page_of(name, f"*{prose(question)}*", *blocks, *_history(name, folder))


def _history(study: str, folder: Path) -> Iterator[str]:
    """Yield the table of earlier answers, level by level."""
    file = folder / HISTORY
    text = file.read_text(encoding="utf-8") if file.exists() else ""
    rows = [
        [line["version"], line["date"], prose(line["level"]), *_shown(line)]
        for line in csv.DictReader(text.splitlines())
        if line["study"] == study
    ]
    if rows:
        yield "## Earlier answers"
        yield table(["version", "date", "level", "difference", "95 % band"], rows)


def _shown(line: dict[str, str]) -> list[str]:
    mean, low, high = (number(float(line[key])) for key in ("mean", "low", "high"))
    return [mean, f"{low} to {high}"]


def questions() -> dict[str, str]:
    """Return the question of each shipped study, by name."""
    return {name: str(study["question"]) for name, study in _studies().items()}


@cache
def _studies() -> dict[str, dict[str, Any]]:
    """Return the content of each shipped study's file, by name."""
    found = everything("studies")["studies"]
    return {each.name: load_yaml(Path(str(each.file))).data for each in found}


def _summary(kept: dict[str, KeptAnswer]) -> str:
    rows = (
        [f"[{name}]({name}.md)", prose(question), *_found(kept.get(name))]
        for name, question in questions().items()
    )
    names = "\n".join(questions())
    return page_of(
        "Results",
        _HEAD,
        table(["study", "question", "answer", "status", "version, date"], rows),
        f"```{{toctree}}\n:hidden:\n\n{names}\n```",
    )


def _found(answer: KeptAnswer | None) -> list[str]:
    if answer is None:
        return ["not kept yet", "", ""]
    return [_headline(answer), _status(answer), f"{answer.version}, {answer.date}"]


def _headline(answer: KeptAnswer) -> str:
    """Return the first sentence of the answer, as its report begins."""
    return prose(first_and_rest(answer.answer)[0])


def _status(answer: KeptAnswer) -> str:
    stale = f", no longer given since {answer.stale_since}" if answer.stale_since else ""
    return f"{answer.status}{stale}"


def _open(study: str) -> Iterator[str]:
    yield "No answer of this study is kept yet."
    yield shell(_calls(study))


def _answered(answer: KeptAnswer, folder: Path) -> Iterator[str]:
    manifest = read_manifest(answer.study, folder)
    yield "## Answer"
    first, rest = first_and_rest(answer.answer)
    yield f"**{prose(first)}** {prose(rest)}"
    yield _picture(answer.study)
    yield from _map(answer)
    yield _band(answer)
    yield from _predictions(answer, manifest)
    yield "## Conditions"
    yield "The answer holds for these models and settings."
    yield table(["", ""], _conditions(manifest))
    yield "## Run"
    remarks = "".join(f"; {remark}" for remark in manifest["status"]["why"])
    yield (
        f"{capital(_status(answer))}{prose(remarks)}. dva-sim {answer.version}, "
        f"commit {code(answer.commit[:12])}, {answer.date}, seed {answer.seed}, "
        f"{answer.persons} persons, {answer.runs} runs, {_duration(answer.cpu_s)} of CPU time."
    )
    yield shell(_calls(answer.study))


@cache
def remarks() -> dict[str, dict[str, Any]]:
    """Return what was added beside kept answers, by study: see the file."""
    return dict(load_yaml(REMARKS).data)


def _predictions(answer: KeptAnswer, manifest: dict[str, Any]) -> Iterator[str]:
    """Yield the table of hypotheses and predictions, and what was measured where that is noted."""
    measured = remarks().get(answer.study, {}).get("measured", {})
    claims = manifest["study"].get("hypotheses") or {}
    rows = [
        [f"{code(name)}: {prose(claims[name]['text'])}", out, prose(measured.get(name, ""))]
        for name, out in answer.hypotheses
    ]
    rows += [[prose(text), out, ""] for text, out in answer.predictions]
    if not rows:
        return
    yield "## Predictions"
    yield "Written down before the study was run."
    heads = ["prediction", "outcome", "measured"]
    last = len(heads) if measured else len(heads) - 1
    yield table(heads[:last], (row[:last] for row in rows))


def _map(answer: KeptAnswer) -> Iterator[str]:
    """Yield the table of a choice map, and what runs are like in each of its cells."""
    for title, words, found in (
        ("The map", _HOW_TO_READ, answer.map),
        ("What drives are like", "From the least to the greatest over the models.", answer.beside),
    ):
        if found:
            heads, *rows = ([prose(cell) for cell in row] for row in _remarked(answer, found))
            yield f"## {title}"
            yield words
            yield table(heads, rows)


def _remarked(answer: KeptAnswer, found: Table) -> Table:
    """Return a table with the remarks on its cells in them."""
    cells = remarks().get(answer.study, {}).get("cells", {})
    heads = found[0]
    return tuple(
        tuple(
            f"{cell} ({noted})" if (noted := cells.get(row[0], {}).get(head)) else cell
            for head, cell in zip(heads, row, strict=True)
        )
        for row in found
    )


def _duration(seconds: float) -> str:
    return f"{seconds / 60:.0f} min" if seconds >= 120 else f"{seconds:.0f} s"


def _calls(study: str) -> list[str]:
    """Return the commands that run a study: how long it takes, its small version, all of it."""
    has_small = "quick" in _studies().get(study, {})
    small = [f"dva-sim run {study} --quick -o results/quick"] if has_small else []
    return [f"dva-sim run {study} --dry-run", *small, f"dva-sim run {study}"]


def _picture(study: str) -> str:
    if not (PICTURES / f"{study}.png").exists():
        return ""
    return f"![The answer of {study}](../../experiments/pictures/{study}.png)"


def _band(answer: KeptAnswer) -> str:
    """Return the contrast at each level with its simultaneous band, or with its interval."""
    if answer.contrast is None or not answer.rows:
        return ""
    unit = unit_of(answer.measure)
    head = f"{' minus '.join(answer.contrast)}{f' [{unit}]' if unit else ''}"
    rows = (
        [prose(_level(answer, n)), number(r.mean), f"{number(r.low)} to {number(r.high)}"]
        for n, r in enumerate(answer.rows)
    )
    if not answer.over:
        row = answer.rows[0]
        found = f"{number(row.mean)} (95 % interval {number(row.low)} to {number(row.high)})"
        return f"{code(answer.measure)}, {prose(head)}: {found}."
    title = f"Measure: {code(answer.measure)}, {prose(measure_name(answer.measure))}."
    return f"{title}\n\n{table([prose(factor_name(answer.over)), prose(head), '95 % band'], rows)}"


def _level(answer: KeptAnswer, at: int) -> str:
    return str(level_name(answer.over, answer.rows[at].level))


def _conditions(manifest: dict[str, Any]) -> Iterator[list[str]]:
    """Yield what was varied and what was held fixed, as the manifest has it."""
    study = manifest["study"]
    varied = set(study["factors"])
    for levels in study["treatments"].values():
        varied.update(key for changes in levels.values() for key in changes)
    for factor, levels in study["factors"].items():
        yield [f"varied: {code(factor)}", ", ".join(code(level) for level in levels)]
    for key, level in ((study.get("answer") or {}).get("within") or {}).items():
        yield [f"answer at {code(key)}", code(level)]
    for part, scenario in manifest["scenarios"].items():
        yield [f"part {code(part)}", prose(str(scenario.get("description") or ""))]
        yield from _models(scenario, varied)
    if robustness := study.get("robustness"):
        parts = (f"{key}: {code(value)}" for key, value in robustness.items() if value)
        yield ["answer repeated over", "; ".join(parts)]
    for level, note in ((study.get("map") or {}).get("notes") or {}).items():
        yield [f"extrapolated at {code(level)}", prose(note)]


def _models(scenario: dict[str, Any], varied: set[str]) -> Iterator[list[str]]:
    """Yield the profiles and plug-ins of a scenario that no treatment changes."""
    for key in _FIXED:
        part, _, name = key.partition(".")
        held = scenario.get(part)
        value = held.get(name) if isinstance(held, dict) else None
        if value is not None and key not in varied:
            yield [code(key), code(value)]
