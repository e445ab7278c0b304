"""The page of assumed numbers about people and phones: key, default, band and reason."""

from __future__ import annotations

from itertools import groupby

from dva_sim.kernel.assumed import Assumption
from dva_sim.simulation.scenario.assumptions import all_assumptions
from generators.markdown import code, sentence, table
from generators.markdown import page as page_of

_HEAD = """\
No published measurement of these numbers was found. Each has a band of plausible values. A
scenario, `--set KEY=VALUE` and a factor of a study set them like every other key. The `screening`
of a study shows which of them change its answer. A trait is the median of a distribution over
persons. `dva-sim assumed` prints the same list."""


def page() -> str:
    """Return the page in Markdown."""
    blocks = [_HEAD]
    for group, members in groupby(all_assumptions(), _group):
        blocks += [f"## {group}", _table(list(members))]
    return page_of("Assumed numbers", *blocks)


def _group(each: Assumption) -> str:
    return each.key.removesuffix(".median").rpartition(".")[0]


def _table(members: list[Assumption]) -> str:
    rows = (
        [
            code(each.key),
            f"{each.default:g}",
            f"{each.low:g} to {each.high:g}",
            each.unit,
            sentence(each.why),
        ]
        for each in members
    )
    return table(["key", "default", "band", "unit", "reason for the band"], rows)
