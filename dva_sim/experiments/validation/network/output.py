"""What the comparison leaves behind: its rows, its words and its page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from dva_sim.experiments.validation.network.comparing import Comparison
from dva_sim.experiments.validation.network.judging import MIN_INSIDE, share_inside
from dva_sim.experiments.validation.network.kinds import KINDS, Kind
from dva_sim.experiments.validation.network.pictures import draw_all
from dva_sim.experiments.validation.network.pooling import Pooled, bias_limit
from dva_sim.experiments.validation.network.tables import (
    HEADS,
    number,
    rows_of,
    table,
    variant_rows,
)
from dva_sim.experiments.validation.writing import render, write_all

NAME = "network"
FEW_SINGLES = 20
SUMMARY_HEADS = ("what", "found", "asked for", "verdict")
ABLATION_HEADS = ("left out, or instead", "RMS z", "expected", "significant")
TITLES: dict[Kind, str] = {
    "lossless": "Without loss, load below 0.95",
    "overload": "Overload without loss",
    "single": "Single runs under loss",
    "pooled": "Pooled runs under loss, at least six seeds each",
}
TOLD: dict[Kind, str] = {
    "lossless": "without loss, within the bands",
    "overload": "overload, within the bands",
    "single": "single runs under loss, within the model's 95 % intervals",
    "pooled": "pooled under loss, where runs hardly differ: within the bands",
}


def write(folder: Path, comparison: Comparison, conditions: Mapping[str, str]) -> Path:
    """Write everything; the page's path.

    Args:
        folder: Made if it is not there.
        comparison: What was found.
        conditions: What the page says of how.

    Raises:
        DvaSimError: the folder cannot be written.
    """
    drawn = draw_all(comparison)
    page = render(
        "validation-network.html.j2",
        drawn,
        headline=headline(comparison),
        notes=notes(comparison),
        fails=not comparison.passes,
        conditions=conditions,
        summary=summary(comparison),
        ablation=ablation(comparison),
        heads=HEADS,
        groups=[(TITLES[kind], table(comparison, kind)) for kind in KINDS],
        left_out=left_out(comparison),
    )
    kept = {NAME: rows_of(comparison)}
    if comparison.controls or comparison.ablated:
        kept["variants"] = variant_rows(comparison)
    return write_all(folder, kept, drawn, page)


def headline(comparison: Comparison) -> str:
    """What it comes to, in two sentences."""
    judged = comparison.judged
    counts = ", ".join(
        f"{sum(g.kind == kind for g in judged)} {words}"
        for kind, words in zip(
            KINDS, ("without loss", "overloaded", "single", "pooled"), strict=True
        )
    )
    verdict = "passes" if comparison.passes else "fails"
    return f"{len(judged)} conditions are judged ({counts}). The model {verdict}."


def notes(comparison: Comparison) -> list[str]:
    """What is missing, and what was found out."""
    found = []
    every, pooled = comparison.missing
    if every or pooled:
        found.append(
            f"Wanted beyond these: {every} more conditions, {pooled} more pooled under loss. "
            "`dva-sim validate network --measure FILE` makes them."
        )
    if comparison.pooled.scored:
        chance = 100 * comparison.pooled.false_alarms
        found.append(
            f"If the model were right, something would still be significant in {chance:.0f} % "
            "of such comparisons."
        )
    singles = sum(group.kind == "single" for group in comparison.judged)
    if 0 < singles < FEW_SINGLES:
        found.append(
            f"Of single runs under loss there are only {singles}: the measures of a run go "
            "together, so an unlucky one counts for many."
        )
    if comparison.rarely:
        found.append(
            f"{len(comparison.rarely)} measures of pooled conditions are left out: too rare, or "
            "not defined in most runs."
        )
    return found


def summary(comparison: Comparison) -> list[tuple[str, str, str, str]]:
    """Each criterion: what, found, asked for, verdict."""
    rows = []
    for kind in KINDS:
        inside, judged = share_inside(comparison.of_kind(kind))
        if judged:
            least = f"{100 * MIN_INSIDE:.0f} %" if kind == "single" else "all"
            share = f"{inside} of {judged} ({100 * inside / judged:.1f} %)"
            rows.append((TOLD[kind], share, least, _passes(comparison.passes_bands(kind))))
    if comparison.pooled.scored:
        rows += _pooled_rows(comparison.pooled)
    for name, pooled in comparison.controls.items():
        found = f"RMS z {pooled.rms:.1f}, {len(pooled.significant)} significant"
        verdict = "fooled us" if pooled.passes else "found out"
        rows.append((f"control: {name}", found, "to be found out", verdict))
    return rows


def _pooled_rows(pooled: Pooled) -> list[tuple[str, str, str, str]]:
    low, high = pooled.expected
    count = len(pooled.scored)
    rows = [
        (
            "pooled under loss, significant after Holm",
            f"{len(pooled.significant)} of {count}",
            "none",
            _passes(not pooled.significant),
        ),
        (
            "pooled under loss, root mean square of z",
            f"{pooled.rms:.2f}",
            f"{low:.2f} to {high:.2f}",
            _passes(pooled.spread_is_right),
        ),
    ]
    if pooled.biases:
        worst = max(pooled.biases, key=lambda m: abs(pooled.biases[m]) / bias_limit(m))
        bias = f"{100 * pooled.biases[worst]:+.1f} % ({worst.words})"
        asked = f"below {100 * bias_limit(worst):.0f} %"
        what = "pooled under loss, worst median bias"
        rows.append((what, bias, asked, _passes(not pooled.biased)))
    return rows


def ablation(comparison: Comparison) -> list[tuple[str, str, str, str]]:
    """Root mean square of z with something left out, the worst first."""
    own = comparison.pooled
    found = {"nothing": own, **comparison.controls, **comparison.ablated}
    if not comparison.ablated:
        return []
    ordered = sorted(found.items(), key=lambda item: -item[1].rms)
    return [
        (
            name,
            f"{pooled.rms:.2f}",
            f"{own.expected[0]:.2f} to {own.expected[1]:.2f}",
            f"{len(pooled.significant)} of {len(pooled.scored)}",
        )
        for name, pooled in ordered
    ]


def left_out(comparison: Comparison) -> list[tuple[str, str]]:
    """Why conditions were not judged, and how many."""
    reasons: dict[str, list[str]] = {}
    for group in comparison.left_out:
        reasons.setdefault(group.left_out, []).append(group.condition.label)
    return [(why, _some(labels)) for why, labels in reasons.items()]


def _some(labels: Sequence[str]) -> str:
    return f"{len(labels)} conditions" if len(labels) > 12 else ", ".join(labels)


def _passes(passes: bool) -> str:
    return "passes" if passes else "fails"


def worst(comparison: Comparison, count: int) -> list[str]:
    """The largest z, in words."""
    ordered = sorted(comparison.pooled.scored, key=lambda s: -abs(s.z))[:count]
    return [
        f"{s.cell.group.condition.label} {s.cell.measure.name}: measured "
        f"{number(s.cell.real)}, predicted {number(s.cell.model)}, z {s.z:.1f}"
        for s in ordered
    ]
