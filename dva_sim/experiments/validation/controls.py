"""What is known of a run's luck: sums over batches whose mean is zero, whatever serves whom.

First order: how many events came, how long looking and going took, against what the
scenario says of their means. Second order: whether long services met short intervals *in a
row*. The product of one service's surplus with the faded surplus of those before it has mean
zero too, since each is drawn anew; where it is large, queues were longer than the averages
explain.

A queue beside it: the same events at *one* server, as fast as all responders together. Its
waits follow from the inputs alone (Lindley's recursion), and their mean is known (Pollaczek
and Khinchine). Where there is one responder only, it is 10 % faster than that one: an exact
copy would leave nothing to be estimated.

References:
    S. S. Lavenberg, T. L. Moeller & P. D. Welch, Oper. Res. 30 (1982) 182-202 (work and flow
    variables as controls); S. S. Lavenberg & P. D. Welch, Manage. Sci. 27 (1981) 322-335
    (external controls: a similar system with a known answer, fed with the same numbers).
"""

from __future__ import annotations

import numpy as np

from dva_sim.experiments.validation.measures import Batches
from dva_sim.experiments.validation.sample import NOBODY, Floats, Sample
from dva_sim.timed.laws import Exponential, Law
from dva_sim.timed.scenario import TimedScenario

FADING = (3.0, 10.0, 30.0, 100.0)  # [events]
FASTER = 0.9  # what the one server beside one responder takes of its time


def controls(batches: Batches, scenario: TimedScenario) -> dict[str, Floats]:
    """Each control's value in each batch, the most telling first; all have mean zero."""
    sample, counts = batches.sample, _counts(batches, scenario)
    look, square = _looks(sample, scenario)
    found = _beside(batches, scenario)
    found["look"] = batches.total(look, sample.served)
    if len(counts) == len(scenario.demand):  # no finite sources: arrivals are all luck
        found["events"] = sum(counts.values(), np.zeros(len(batches.lengths)))
        found |= _products(batches, scenario, look)
    found["look_square"] = batches.total(square, sample.served)
    return found | {f"events@{name}": count for name, count in list(counts.items())[1:]}


def inputs(batches: Batches, scenario: TimedScenario) -> dict[str, tuple[Floats, Floats]]:
    """What was put in, and what the scenario lets expect of it: events and looking time.

    A control takes the luck of the inputs off; that the inputs are right must be seen apart.
    """
    found = {}
    for name, surplus in _counts(batches, scenario).items():
        number = scenario.stream_names.index(name)
        came = batches.count(batches.sample.stream == number)
        found[f"events of {name}"] = came, came - surplus
    sample = batches.sample
    took = np.where(sample.served, sample.confirmed - sample.arrived, 0.0)
    looks = batches.total(took, sample.served)
    expected = looks - batches.total(_looks(sample, scenario)[0], sample.served)
    if expected.any():
        found["looking"] = looks, expected
    return found


def _counts(batches: Batches, scenario: TimedScenario) -> dict[str, Floats]:
    """How many events of each stream came, above what its intervals let expect."""
    found = {}
    for number, (name, stream) in enumerate(
        zip(scenario.stream_names, scenario.demand, strict=True)
    ):
        if stream.between is not None:
            came = batches.count(batches.sample.stream == number)
            found[name] = came - batches.lengths / stream.between.mean
    return found


def _looks(sample: Sample, scenario: TimedScenario) -> tuple[Floats, Floats]:
    """How much longer than its mean each look took, and its square; 0 where nobody looked."""
    groups = {group.name: group.look for group in scenario.responders}
    means, variances = np.zeros(len(sample.stream)), np.zeros(len(sample.stream))
    for number, stream in enumerate(scenario.demand):
        for unit, group in enumerate(sample.groups):
            law: Law = stream.look if stream.look is not None else groups[group]
            which = (sample.stream == number) & (sample.unit == unit)
            means[which], variances[which] = law.mean, law.variance
    looked = sample.served & (sample.unit != NOBODY)
    surplus = np.where(looked, sample.confirmed - sample.arrived - means, 0.0)
    return surplus, np.where(looked, surplus**2 - variances, 0.0)


def _beside(batches: Batches, scenario: TimedScenario) -> dict[str, Floats]:
    """Waits, above their mean, if one fast server had served the same events in their order.

    None where events come otherwise than at random, or are not all served.
    """
    sample, streams, dispatch = batches.sample, scenario.demand, scenario.dispatch
    between = [s.between for s in streams if isinstance(s.between, Exponential)]
    limited = dispatch.escalate_after_s is not None or dispatch.most_waiting is not None
    limited |= dispatch.containment or any(s.patience is not None for s in streams)
    if limited or len(between) != len(streams) or scenario.way != "none":
        return {}
    pace = (FASTER if len(sample.units) == 1 else 1.0) / len(sample.units)
    rates = [1 / law.mean for law in between]
    laws = _look_laws(scenario)
    if laws is None:
        return {}
    load = pace * sum(r * law.mean for r, law in zip(rates, laws, strict=True))
    square = pace**2 * sum(r * law.second for r, law in zip(rates, laws, strict=True))
    if load >= 1:
        return {}
    mean = square / (2 * (1 - load))  # Pollaczek-Khinchine
    look = pace * (sample.confirmed - sample.arrived)
    waits = lindley(np.diff(sample.detected), look[:-1])
    return {"beside": batches.total(waits - mean, np.ones(len(waits), dtype=bool))}


def lindley(gaps: Floats, services: Floats) -> Floats:
    """Waits at one server, first come first served, the first of them 0.

    Args:
        gaps: From each customer to the next `(n - 1,)`.
        services: Of all but the last `(n - 1,)`.

    References:
        D. V. Lindley, Proc. Camb. Phil. Soc. 48 (1952) 277-289.
    """
    way = np.concatenate([[0.0], np.cumsum(services - gaps)])
    return np.asarray(way - np.minimum.accumulate(way))


def _look_laws(scenario: TimedScenario) -> list[Law] | None:
    """How long looking takes for each stream; None if it depends on who looks."""
    own = {group.look for group in scenario.responders}
    common = own.pop() if len(own) == 1 else None
    laws = [stream.look if stream.look is not None else common for stream in scenario.demand]
    return None if any(law is None for law in laws) else [law for law in laws if law is not None]


def _products(batches: Batches, scenario: TimedScenario, look: Floats) -> dict[str, Floats]:
    """Surplus of each step of the queue times the faded surplus of the steps before."""
    from scipy.signal import lfilter

    rate = sum(1 / stream.between.mean for stream in scenario.demand if stream.between)
    gaps = np.diff(batches.sample.detected, prepend=np.nan) - 1 / rate
    step = np.concatenate([[0.0], look[:-1] / len(batches.sample.units)]) - gaps
    step[:1] = 0.0
    everything = np.ones(len(step), dtype=bool)
    found = {}
    for length in FADING:
        keep = 1 - 1 / length
        before = np.concatenate([[0.0], lfilter([1.0], [1.0, -keep], step)[:-1]])
        found[f"row_{length:g}"] = batches.total(step * before, everything)
    return found
