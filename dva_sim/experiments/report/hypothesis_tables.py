"""Tables of hypotheses and comparisons: claim beside result."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from dva_sim.experiments.analysis.answer import too_few
from dva_sim.experiments.analysis.answer_sentences import EXTRAPOLATED
from dva_sim.experiments.analysis.hypothesis_tests import Compared, Judgement, Tested, Verdict
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.prose import note
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import capital, number, quantity, signed
from dva_sim.simulation.labels import level_name, measure_of, setting
from dva_sim.statistics import LEVEL, Interval

# A mark beside the word: neither needs a colour.
_VERDICTS: dict[Verdict, str] = {
    "held": "✓ held",
    "did not hold": "✗ did not hold",
    "open": "? open",
    "not run": "– not run",
}
_LEAST_P = 0.001


def hypothesis_table(tested: Sequence[Tested], cluster: str = "person") -> CellTable:
    """Each hypothesis: the claim, what was found, the adjusted test, the verdict."""
    heads = ["hypothesis", "claim", "found (interval at the level of the verdict)"]
    heads += ["p by Holm", "p of the opposite", "verdict"]
    rows = [
        [
            ": ".join(filter(None, (t.name, t.hypothesis.text))),
            _claim(t),
            _found(t),
            _p(t.adjusted),
            _p(t.against),
            ": ".join(filter(None, (_VERDICTS[t.verdict], _few(t, cluster)))),
        ]
        for t in tested
    ]
    return CellTable("", heads, len(heads), rows, note=note("hypotheses"))


def _few(tested: Tested, cluster: str) -> str:
    """Say that a hypothesis stayed open for want of persons; else an empty text."""
    found, least = tested.difference, tested.contrast.smallest or tested.hypothesis.margin or None
    is_few = tested.verdict == "open" and found is not None and _are_few(found, least)
    return too_few(found.n_persons, cluster) if is_few and found is not None else ""


def _are_few(found: Interval, smallest: float | None, tests: int = 1) -> bool:
    """True if the test, or ruling out the declared difference, needs more persons."""
    if _least_p(found.n_persons, tests) > 1 - LEVEL:
        return True
    return smallest is not None and max(-found.low, found.high) > smallest


def _least_p(persons: int, tests: int) -> float:
    """The least p that a permutation test can give by Holm, as the first of a family of tests."""
    return min(1.0, tests * 2.0 ** (1 - persons))


_SETTLED: dict[Verdict, str] = {
    "held": "held",
    "did not hold": "was refuted",
    "open": "is undecided",
    "not run": "was not run",
}
_OPENINGS: dict[Verdict, str] = {
    "held": "",
    "did not hold": "it is not so that ",
    "open": "whether ",
    "not run": "whether ",
}
"""Words before a claim in the lead; a refuted one alone would read as the result."""
_ORDER: tuple[Verdict, ...] = ("did not hold", "open", "not run", "held")
_MOST_NAMED = 2  # hypotheses, before the rest are only counted


def verdict_lead(
    tested: Sequence[Tested], cluster: str, *, is_extrapolated: bool, only_model: str
) -> str:
    """The verdicts on registered hypotheses in at most two sentences, refuted ones first.

    Args:
        tested: The hypotheses as they came out; at least one.
        cluster: Unit of resampling.
        is_extrapolated: True if any lies beyond the delays at which people were watched.
        only_model: The one model of the persons that was tried; empty if several were.
    """
    ranked = sorted(tested, key=lambda claim: _ORDER.index(claim.verdict))
    named = [t for t in ranked if t.verdict == ranked[0].verdict][:_MOST_NAMED]
    beyond = f" ({EXTRAPOLATED})" if is_extrapolated else ""
    first = f"{_counted(ranked)}{beyond}: {'; '.join(_with_facts(t, cluster) for t in named)}."
    rest = Counter(t.verdict for t in ranked)
    del rest[ranked[0].verdict]
    clauses = [f"{n} of the others {_SETTLED[verdict]}" for verdict, n in rest.items()]
    if only_model:
        clauses.append(f"only one model of the persons was tried ({only_model})")
    return f"{first} {capital('; '.join(clauses))}." if clauses else first


def _counted(ranked: Sequence[Tested]) -> str:
    """`Both registered hypotheses held`, `1 of 3 registered hypotheses was refuted`."""
    verdict, count = ranked[0].verdict, len(ranked)
    same = sum(t.verdict == verdict for t in ranked)
    if count == 1:
        return f"Registered hypothesis {ranked[0].name} {_SETTLED[verdict]}"
    settled = _SETTLED[verdict]
    if same > 1:
        settled = settled.replace("was ", "were ").replace("is ", "are ")
    some = f"{same} of {count}" if same < count else "Both" if count == 2 else f"All {count}"
    return f"{some} registered hypotheses {settled}"


def _inside(text: str) -> str:
    """A sentence as a clause of another: without its full stop, and small unless it is a name."""
    clause = text.strip().removesuffix(".")
    return clause[:1].lower() + clause[1:] if clause[1:2].islower() else clause


def _with_facts(tested: Tested, cluster: str) -> str:
    """`Waiting costs (4.0 s, 90 % interval 3.0 to 5.0 s, claimed above 2.0 s)`."""
    text = _OPENINGS[tested.verdict] + _inside(tested.hypothesis.text or _claim(tested))
    if tested.difference is None:
        return text
    found, unit = tested.difference, unit_of(tested.contrast.measure)
    facts = [
        f"{signed(found.mean, unit)}",
        f"{_level(tested)} interval {number(found.low)} to {quantity(found.high, unit)}",
        f"claimed {bound_of(tested)}",
        _few(tested, cluster),
    ]
    return f"{text} ({', '.join(filter(None, facts))})"


def comparison_table(found: Judgement, cluster: str = "person") -> CellTable:
    """Each comparison at each level it runs over."""
    compared = found.compared
    families = Counter(c.contrast.family for c in compared)
    families.update(t.contrast.family for t in found.tested)
    heads = ["comparison", "difference in", "at", "first minus second (95 % interval)"]
    heads += ["in standard deviations", "correlation of pairs", "p", "p by Holm", "apart?"]
    rows = [
        [
            f"{c.name}: {_sides(c)}",
            measure_of(c.contrast.measure, c.contrast.part),
            (setting(c.at) or "on average"),
            _interval(c.difference, c.contrast.measure),
            _bare(c.size.average) if c.size else "–",
            number(c.correlation),
            _p(c.p),
            _p(c.adjusted),
            _apart(c, cluster, families[c.contrast.family]),
        ]
        for c in compared
    ]
    persons = max((c.difference.n_persons for c in compared if c.difference), default=0)
    tests = max((families[c.contrast.family] for c in compared), default=1)
    least = _least_p(persons, tests) if persons else 0.0  # whatever the runs
    counts = "; ".join(f"{name}: {count}" for name, count in families.items())
    least_p = f"{least:.2g}" if least > 1 - LEVEL else ""
    needed = math.ceil(math.log2(2 * tests / (1 - LEVEL)))
    text = note("comparisons", families=counts, persons=persons, least_p=least_p, needed=needed)
    return CellTable("", heads, len(heads), rows, note=text)


def _sides(compared: Compared) -> str:
    first, second = (level_name(compared.contrast.factor, x) for x in compared.contrast.contrast)
    return f"{first} minus {second}"


def _claim(tested: Tested) -> str:
    """`A minus B in driving time, at delay 1 s: above 2 s`."""
    first, second = (level_name(tested.contrast.factor, x) for x in tested.contrast.contrast)
    where = f", {setting(tested.at)}" if tested.at else ""
    measure = measure_of(tested.contrast.measure, tested.contrast.part)
    return f"{first} minus {second} in {measure}{where}: {bound_of(tested)}"


def bound_of(tested: Tested) -> str:
    """`above 2.0 s`, `below −2.0 s` or `the same within 2.0 s`."""
    claim, unit = tested.hypothesis, unit_of(tested.contrast.measure)
    margin = quantity(claim.margin, unit) if claim.margin else "zero"
    return {
        "above": f"above {margin}",
        "below": f"below {'−' if claim.margin else ''}{margin}",
        "same": f"the same within {margin}",
    }[claim.direction]


def verdict_of_name(tested: Tested) -> str:
    """`✓ held: waiting`, in two lines."""
    return f"{_VERDICTS[tested.verdict]}\n{tested.name}"


def verdict_with_interval(tested: Tested) -> str:
    """`✓ held: 4.0 s (3.0 to 5.0 s, 90 %)`."""
    if tested.difference is None:
        return _VERDICTS[tested.verdict]
    return f"{_VERDICTS[tested.verdict]}: {_found(tested)}"


def _found(tested: Tested) -> str:
    """`4.0 s (3.0 to 5.0 s, 90 %)`: the difference with the interval that decides."""
    text = _interval(tested.difference, tested.contrast.measure)
    return text if tested.difference is None else f"{text[:-1]}, {_level(tested)})"


def _level(tested: Tested) -> str:
    """`90 %`, `99.4 %`: level of the interval that decides."""
    return f"{100 * tested.level:.3g} %"


def _interval(found: Interval | None, measure: str) -> str:
    if found is None:
        return "not run"
    unit = unit_of(measure)
    return f"{quantity(found.mean, unit)} ({number(found.low)} to {quantity(found.high, unit)})"


def _bare(found: Interval) -> str:
    return f"{number(found.mean)} ({number(found.low)} to {number(found.high)})"


def _p(value: float) -> str:
    if not math.isfinite(value):
        return "–"
    return f"< {_LEAST_P:g}" if value < _LEAST_P else f"{value:.3f}"


def _apart(compared: Compared, cluster: str, tests: int) -> str:
    found = compared.difference
    if not math.isfinite(compared.adjusted) or found is None:
        return "–"
    if compared.adjusted <= 1 - LEVEL:
        return "✓ yes"
    is_few = _are_few(found, compared.contrast.smallest, tests)
    return f"? {too_few(found.n_persons, cluster)}" if is_few else "? not shown"
