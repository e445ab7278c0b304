"""Evidence on the network: a line for each measure of each condition, and the rule for all.

Without loss a prediction lies in its band, and a single run under loss in the model's interval;
pooled runs are scored together, and models that are too simple have to be found out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

from dva_sim.validation.evidence import NORMAL_95, RULE, Evidence, Verdict, share_rule
from dva_sim.validation.evidence_page import ResultSheet, ValidationResult
from dva_sim.validation.frame import Row
from dva_sim.validation.network.comparison import NetworkComparison
from dva_sim.validation.network.pooling import Pooled, Scored, bias_limit
from dva_sim.validation.network.verdicts import (
    BY_NAME,
    KINDS,
    MIN_INSIDE,
    ComparedCell,
    ConditionGroup,
    ConditionKind,
    share_inside,
)

FEW_SINGLES = 20
GROUPS: dict[ConditionKind, str] = {
    "lossless": "Without loss, load below 0.95: within the bands",
    "overload": "Overload without loss: within the bands",
    "single": "Single runs under loss: within the model's 95 % intervals",
    "pooled": "Pooled runs under loss, at least six seeds each",
}
RULES: dict[ConditionKind, str] = {
    "lossless": "without loss",
    "overload": "overload",
    "single": "single runs under loss",
    "pooled": "pooled under loss, where runs hardly differ",
}
LEFT_OUT = "Conditions that are not played"
ABLATION_HEADS = ("left out, or instead", "RMS z", "expected", "significant")
_WORDS: dict[str, Verdict] = {"inside": "holds", "outside": "misses", "shown only": "shown only"}
_line = partial(Evidence, "network")


def evidence(
    comparison: NetworkComparison, conditions: Mapping[str, str], causes: Mapping[str, str]
) -> ValidationResult:
    """Return the result of all conditions.

    Args:
        conditions: Conditions of the comparison, by name.
        causes: Known causes of misses, by the label of a condition.
    """
    without = ResultSheet("What is left out", ABLATION_HEADS, ablation(comparison))
    is_varied = comparison.controls or comparison.ablated
    return ValidationResult(
        [*lines_of(comparison, causes), *rule_of(comparison)],
        notes=notes(comparison),
        conditions=conditions,
        sheets=[without] if without.rows else [],
        tables={"variants": variant_rows(comparison)} if is_varied else {},
    )


def lines_of(comparison: NetworkComparison, causes: Mapping[str, str]) -> list[Evidence]:
    """Return every measure of every condition by its kind, misses that count with their causes."""
    lines = [
        replace(
            _of_cell(verdict.cell),
            low=_finite(verdict.low),
            high=_finite(verdict.high),
            holds_measured=verdict.cell.group.kind == "single",
            verdict=_WORDS[verdict.word],
            note=verdict.why,
        )
        for verdict in comparison.verdicts
    ]
    outside = comparison.outside
    lines += [_of_score(s, id(s.cell) in outside) for s in comparison.pooled.scored]
    lines += [replace(_of_cell(cell), note="tells too little") for cell in comparison.rarely]
    lines.sort(key=lambda line: list(GROUPS.values()).index(line.group))
    return [_with_cause(line, causes) for line in lines] + [
        _line(
            LEFT_OUT,
            group.condition.label,
            "not played",
            source=_source(group),
            note=group.left_out,
        )
        for group in comparison.left_out
    ]


def _with_cause(line: Evidence, causes: Mapping[str, str]) -> Evidence:
    """Return a miss with its cause; of single runs some have to miss."""
    if line.verdict != "misses" or line.group == GROUPS["single"]:
        return line
    cause = causes.get(line.line.split()[0], "cause not known")
    return replace(line, note="; ".join(filter(None, (line.note, cause))))


def _of_cell(cell: ComparedCell) -> Evidence:
    label = cell.group.condition.label
    return _line(
        GROUPS[cell.group.kind],
        f"{label} {cell.measure.name}",
        cell.measure.words,
        source=_source(cell.group),
        unit=cell.measure.unit,
        measured=_finite(cell.real),
        predicted=_finite(cell.model),
        sample=len(cell.measured),
    )


def _source(group: ConditionGroup) -> str:
    """Return the table of measurements."""
    return f"real sockets, {' and '.join(sorted({run.source for run in group.runs}))} runs"


def _of_score(scored: Scored, is_significant: bool) -> Evidence:
    """Return a mean over runs, judged by z among all; its interval is that of the difference."""
    half = NORMAL_95 * scored.error
    return replace(
        _of_cell(scored.cell),
        predicted_low=scored.cell.model - half,
        predicted_high=scored.cell.model + half,
        verdict="misses" if is_significant else "holds",
        note=f"z {scored.z:+.1f}, p {scored.p:.2g}",
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def rule_of(comparison: NetworkComparison) -> Iterator[Evidence]:
    """Yield the overall criteria: shares inside, pooled runs together, and rejected models."""
    if not comparison.judged:
        return
    for kind in KINDS:
        inside, judged = share_inside(comparison.of_kind(kind))
        if judged:
            least = MIN_INSIDE if kind == "single" else 1.0
            yield share_rule("network", RULES[kind], inside, judged, least=least)
    if comparison.pooled.scored:
        yield from _rule_of_pooled(comparison.pooled)
    for name, pooled in comparison.controls.items():
        yield _line(
            RULE,
            f"control: {name}",
            "root mean square of z of a model that is too simple",
            predicted=pooled.rms,
            verdict="misses" if pooled.passes else "holds",
            note=f"{len(pooled.significant)} significant, "
            + ("has fooled us" if pooled.passes else "found out"),
        )


def _rule_of_pooled(pooled: Pooled) -> Iterator[Evidence]:
    """Yield the rule of pooled figures: nothing significant, z within chance, and no bias."""
    what = "pooled under loss: {}".format
    low, high = pooled.expected
    yield _line(
        RULE,
        what("significant"),
        "number of lines after Holm",
        predicted=float(len(pooled.significant)),
        low=0.0,
        high=0.0,
        sample=len(pooled.scored),
        verdict="misses" if pooled.significant else "holds",
        note=f"{len(pooled.significant)} of {len(pooled.scored)}",
    )
    yield _line(
        RULE,
        what("spread"),
        "root mean square of z",
        predicted=pooled.rms,
        low=low,
        high=high,
        sample=len(pooled.scored),
        verdict="holds" if pooled.spread_is_right else "misses",
    )
    if pooled.biases:
        worst = max(pooled.biases, key=lambda m: abs(pooled.biases[m]) / bias_limit(m))
        yield _line(
            RULE,
            what("bias"),
            f"worst median bias: {worst.words}",
            predicted=pooled.biases[worst],
            low=-bias_limit(worst),
            high=bias_limit(worst),
            verdict="misses" if pooled.biased else "holds",
        )


def notes(comparison: NetworkComparison) -> list[str]:
    """Return notes on the judged lines, on missing conditions and on findings."""
    judged = comparison.judged
    counts = ", ".join(
        f"{sum(g.kind == kind for g in judged)} {words}"
        for kind, words in zip(
            KINDS, ("without loss", "overloaded", "single", "pooled"), strict=True
        )
    )
    lines = [f"{len(judged)} conditions are judged ({counts})."]
    every, pooled = comparison.missing
    if every or pooled:
        lines.append(
            f"Wanted beyond these: {every} more conditions, {pooled} more pooled under loss. "
            "`dva-sim validate network --measure FILE` makes them."
        )
    if comparison.pooled.scored:
        chance = 100 * comparison.pooled.false_alarms
        lines.append(
            f"If the model were right, something would still be significant in {chance:.0f} % "
            "of such comparisons."
        )
    singles = sum(group.kind == "single" for group in judged)
    if 0 < singles < FEW_SINGLES:
        lines.append(
            f"Of single runs under loss there are only {singles}: the measures of a run go "
            "together, so an unlucky one counts for many."
        )
    return lines


def variant_rows(comparison: NetworkComparison) -> list[Row]:
    """Root mean square of z of each variant, over all measures and for each."""
    return [
        {
            "left_out": name,
            "rms_z": pooled.rms,
            "expected_low": pooled.expected[0],
            "expected_high": pooled.expected[1],
            "significant": len(pooled.significant),
            "compared": len(pooled.scored),
            **{f"bias_{m}": pooled.biases.get(measure) for m, measure in BY_NAME.items()},
        }
        for name, pooled in comparison.variants.items()
    ]


def ablation(comparison: NetworkComparison) -> list[tuple[str, str, str, str]]:
    """Root mean square of z with something left out, the worst first."""
    if not comparison.ablated:
        return []
    ordered = sorted(comparison.variants.items(), key=lambda item: -item[1].rms)
    return [
        (
            name,
            f"{pooled.rms:.2f}",
            f"{pooled.expected[0]:.2f} to {pooled.expected[1]:.2f}",
            f"{len(pooled.significant)} of {len(pooled.scored)}",
        )
        for name, pooled in ordered
    ]
