"""Table of a tuning: candidates tried and the value chosen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.prose import note, sentence
from dva_sim.experiments.study.tuning import TunedValues, TuningBasis
from dva_sim.kernel.config import validate
from dva_sim.kernel.wording import number
from dva_sim.simulation.labels import factor_name, level_name, measure_name, setting


def tuned_table(manifest: Mapping[str, Any]) -> CellTable | None:
    """All that a tuning saw, as a report prints it; None where nothing was tuned."""
    if not manifest.get("tuned"):
        return None
    tuned = validate(TunedValues, manifest["tuned"])
    rule = tuned.tuning
    chosen = {(str(c.when), c.value) for c in tuned.chosen}
    rows = [
        [
            *(level_name(name, level) for name, level in seen.when.items()),
            f"{seen.value:g}",
            f"{number(seen.mean)} ({number(seen.low)} to {number(seen.high)})",
            "chosen" if (str(seen.when), seen.value) in chosen else "",
        ]
        for seen in tuned.seen
    ]
    heads = [*(factor_name(name) for name in rule.by), factor_name(rule.key)]
    heads += [f"{measure_name(rule.measure)}, mean (95 % interval)", ""]
    is_other = str(manifest["versions"].get("fingerprint")) not in tuned.made_with
    text = note("tuning", rule=rule, at=setting(rule.at), is_other_version=is_other)
    return CellTable(rule.part, heads, len(rule.by), rows, note=text)


def tuning_warning(manifest: Mapping[str, Any]) -> str:
    """Warn that values were tuned with other persons or phones than the study's."""
    if not manifest.get("tuned"):
        return ""
    tuned = validate(TunedValues, manifest["tuned"])
    others = tuned.basis.unlike(validate(TuningBasis, manifest["basis"]))
    if not others:
        return ""
    factor = factor_name(tuned.tuning.key)
    return sentence("tuned_otherwise", factor=factor, others=others, study=tuned.study)
