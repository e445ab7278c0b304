"""All kept answers as one page: a table of what was found, then each study with its evidence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from dva_sim.experiments.report.kept_answers import KeptAnswer
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import capital, number, quantity
from dva_sim.simulation.labels import factor_name, level_name, measure_name

_HEAD = """\
# Results

<!-- Written by `dva-sim answers --page`. -->

What the shipped studies answered, by which version, and when. Each answer is kept in
[`experiments/answers`](../experiments/answers) with the manifest of its run. `dva-sim answers`
makes a few runs of each study again, and tells which answers the program no longer gives.

*Declared*: run as the study's file says. *Confirmatory*: registered before it was run. Intervals
are those of simulated persons: they hold if the model does."""


def answers_page(answers: Sequence[KeptAnswer]) -> str:
    """The page in Markdown."""
    blocks = [_HEAD, _table(answers), *(_section(answer) for answer in answers)]
    return "\n\n".join(blocks) + "\n"


def _table(answers: Sequence[KeptAnswer]) -> str:
    lines = ["| study | found | status | version, date |", "|---|---|---|---|"]
    lines += [
        f"| [`{a.study}`](#{a.study}) | {_headline(a)} | {a.status}{_stale(a)} | "
        f"{a.version}, {a.date} |"
        for a in answers
    ]
    return "\n".join(lines)


def _headline(answer: KeptAnswer) -> str:
    """The contrast at its last level if levels are quantities; else the first sentence."""
    if answer.contrast is None or not answer.rows or isinstance(answer.rows[-1].level, str):
        return answer.answer.partition(". ")[0].removesuffix(".")
    row, unit = answer.rows[-1], unit_of(answer.measure)
    first, second = answer.contrast
    where = f" ({_level(answer, -1)})" if answer.over else ""
    return (
        f"{first} minus {second} in {measure_name(answer.measure)}{where}: "
        f"{quantity(row.mean, unit)} ({number(row.low)} to {number(row.high)})"
    )


def _stale(answer: KeptAnswer) -> str:
    return f", no longer given since {answer.stale_since}" if answer.stale_since else ""


def _section(answer: KeptAnswer) -> str:
    return "\n\n".join(_parts_of(answer))


def _parts_of(answer: KeptAnswer) -> Iterator[str]:
    yield f"## {answer.study}"
    yield f"*{answer.question}*"
    yield f"**{answer.answer}**"
    if answer.contrast is not None and answer.over:
        unit = unit_of(answer.measure)
        head = f"{' minus '.join(answer.contrast)}{f' [{unit}]' if unit else ''}"
        found = [f"{number(r.mean)} ({number(r.low)} to {number(r.high)})" for r in answer.rows]
        rows = [f"| {_level(answer, n)} | {text} |" for n, text in enumerate(found)]
        yield "\n".join([f"| {factor_name(answer.over)} | {head}, 95 % band |", "|---|---|", *rows])
    if judged := [*answer.hypotheses, *answer.predictions]:
        yield "\n".join(f"- {capital(verdict)}: {text}" for text, verdict in judged)
    yield (
        f"{capital(answer.status)}{_stale(answer)}; dva-sim {answer.version} ({answer.commit}), "
        f"{answer.date}, seed {answer.seed}, {answer.persons} persons, {answer.runs} runs, "
        f"{answer.cpu_s / 60:.0f} CPU minutes."
    )


def _level(answer: KeptAnswer, at: int) -> str:
    return level_name(answer.over, answer.rows[at].level)
