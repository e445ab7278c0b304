"""Estimates with standard errors from batches, sharpened by known random inputs.

A run is cut into batches, long enough to be almost independent; a measure is a sum over a sum
(waits over customers), batch by batch. Its error comes from how much the batches differ.

**Control variates.** Some batches wait long because many came, or because looking took long.
How many came and how long looking takes *on average* is known: it is in the scenario. So what
is explained by random inputs can be taken off, and much smaller errors remain. The
weights come from regression, on *other* batches than the ones they are used on: what is taken
off a batch has mean zero whatever the weights are, so nothing is biased. But a wrong *input*
would be taken off too, and a control whose mean comes from a wrong formula would hide that it
is wrong. Therefore the means and shapes of the inputs are checks of their own, and the
estimate *without* controls has to agree as well.

The controls are sums over batches whose mean is zero, whatever serves whom. First order: how many
events came, how long looking and going took, against what the scenario says of their means. Second
order: whether long services met short intervals *in a row*. The product of one service's surplus
with the faded surplus of those before it has mean zero too, since each is drawn independently;
where it is large, queues were longer than the averages explain. And a queue beside it: the same
events at *one* server, as fast as all responders together. Its waits follow from the inputs alone,
and their mean is known (Pollaczek and Khinchine; Cobham; G/M/1). Where there is one responder only,
that server is 5 % faster: an exact copy would leave nothing to be estimated.

References:
    S. S. Lavenberg & P. D. Welch, Manage. Sci. 27 (1981) 322-335 (control variates; external
    controls: a similar system with a known answer, fed with the same numbers); S. S. Lavenberg,
    T. L. Moeller & P. D. Welch, Oper. Res. 30 (1982) 182-202 (work and flow variables as controls);
    A. N. Avramidis & J. R. Wilson, Oper. Res. Lett. 14 (1993) 187-198 (splitting: weights from
    other batches); W. G. Cochran, Sampling Techniques, 3rd ed. (1977), chapter 6 (ratios).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from dva_sim.simulation.timed.distributions import Exponential, Law
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.validation.dispatch.batch_measures import Batches, Floats, Sample, one_server
from dva_sim.validation.dispatch.exact import cobham
from dva_sim.validation.dispatch.queues import LawMoments, gm1
from dva_sim.validation.dispatch.transforms import laplace
from dva_sim.validation.evidence import Verdict

ERRORS = 3.0  # allowed deviation of an estimate, in standard errors
TOLERANCE = 0.005  # allowed deviation, as a share of the exact value
PRECISION = 0.01  # required standard error, as a share of the exact value
KNOWN_SPREAD_BATCHES = 100  # number of batches from which their spread counts as known
_FOLDS = 10
_BATCHES_PER_CONTROL = 5  # minimum batches per control; with fewer, weights are noise
_ROUNDING = 1e-9  # tolerance for rounding errors


@dataclass(frozen=True)
class Estimate:
    """Estimate of a measure, with and without control variates.

    Attributes:
        value: The estimate.
        error: Standard error of the value.
        plain: Value without control variates.
        plain_error: Standard error of the plain value.
        batches: Number of batches.
    """

    value: float
    error: float
    plain: float
    plain_error: float
    batches: int


def estimate(tops: Floats, bottoms: Floats, controls: Floats | None = None) -> Estimate:
    """Return the ratio of two sums over batches.

    Args:
        tops: Such as the sum of waits in each batch `(n,)`.
        bottoms: Such as the number of customers in each batch `(n,)`.
        controls: Control variates with mean zero, one row per batch `(n, k)`.
    """
    total = float(bottoms.sum())
    if not total:
        return Estimate(math.nan, math.nan, plain=math.nan, plain_error=math.nan, batches=len(tops))
    plain = float(tops.sum()) / total
    off = (tops - plain * bottoms) / (total / len(bottoms))  # linearised: mean zero
    left = off if controls is None else adjusted(off, controls)
    better = plain + float(left.mean())
    return Estimate(better, _error(left), plain, plain_error=_error(off), batches=len(tops))


def certain(value: float) -> Estimate:
    """Return a value that nothing is left to chance in."""
    return Estimate(float(value), 0.0, plain=float(value), plain_error=0.0, batches=1)


def adjusted(values: Floats, controls: Floats) -> Floats:
    """Return the values minus the part explained by controls, with weights from other batches.

    Args:
        values: One per batch `(n,)`.
        controls: Controls of mean zero, the most informative first `(n, k)`; the last ones are left
            out if there are too few batches.
    """
    spread = controls.std(axis=0)
    useful = controls[:, spread > _ROUNDING * (abs(controls).max(axis=0) + _ROUNDING)]
    useful = useful[:, : len(values) // _BATCHES_PER_CONTROL]
    if not useful.shape[1]:
        return values
    useful = useful / useful.std(axis=0)
    adjusted_values = np.empty_like(values)
    # Cross-fitted: weights from the same batches would bias the estimate.
    for fold in np.array_split(np.arange(len(values)), _FOLDS):
        is_other = np.ones(len(values), dtype=bool)
        is_other[fold] = False
        around = np.column_stack([np.ones(is_other.sum()), useful[is_other]])
        weights = np.linalg.lstsq(around, values[is_other], rcond=None)[0][1:]
        adjusted_values[fold] = values[fold] - useful[fold] @ weights
    return adjusted_values


def verdict(estimated: Estimate, exact: float, precision: float | None = PRECISION) -> Verdict:
    """Judge whether an estimate agrees with the exact value.

    Args:
        estimated: The estimate.
        exact: Exact value.
        precision: Required standard error, as a share of the exact value; None if not required.

    Returns:
        `misses`: outside its band, with controls or without them. `too rough`: the standard error
        is above what is asked for, so that agreement says little.
    """
    for value, error in (
        (estimated.value, estimated.error),
        (estimated.plain, estimated.plain_error),
    ):
        if not abs(value - exact) <= half_band(error, exact, estimated.batches):
            return "misses"
    if precision is not None and not estimated.error <= max(
        precision * abs(exact), _rounding(exact)
    ):
        return "too rough"
    return "holds"


def half_band(error: float, exact: float, batches: int) -> float:
    """Return the distance from the exact value up to which an estimate agrees.

    It is 3 standard errors (as many more as Student's t asks for with few batches) or 0.5 %,
    whichever is more.

    Args:
        error: Standard error of the estimate.
        exact: Exact value.
        batches: Number of batches behind the standard error.
    """
    return max(_errors_allowed(batches) * error, TOLERANCE * abs(exact), _rounding(exact))


def _rounding(exact: float) -> float:
    return _ROUNDING * max(1.0, abs(exact))


@cache
def _errors_allowed(batches: int) -> float:
    """Return by how many standard errors a correct estimate from `batches` may be off."""
    if not 1 < batches < KNOWN_SPREAD_BATCHES:
        return ERRORS
    from scipy import special

    return float(special.stdtrit(batches - 1, 1 - math.erfc(ERRORS / math.sqrt(2)) / 2))


def expected_alarms(checks: int) -> float:
    """Return the expected maximum number of false alarms among correct checks.

    Each may by either of its two estimates.
    """
    return 2 * checks * math.erfc(ERRORS / math.sqrt(2))


def _error(values: Floats) -> float:
    """Return standard error of a mean; nan with fewer than two values."""
    if len(values) < 2:
        return math.nan
    error = float(values.std(ddof=1)) / math.sqrt(len(values))
    return error if error > 1e-14 * float(abs(values).max()) else 0.0


FADING = (3.0, 10.0, 30.0, 100.0)  # [events]
FASTER = 0.95  # relative service time of the second, faster control queue


def controls(batches: Batches, scenario: TimedScenario) -> dict[str, Floats]:
    """Return each control's value in each batch, the most telling first; all have mean zero."""
    sample = batches.sample
    counts = _counts(batches, scenario)
    look, square = _looks(sample, scenario)
    beside = _beside(batches, scenario)
    variates = beside | {"look": batches.total(look, sample.served)}
    if counts:
        variates["events"] = sum(counts.values(), np.zeros(len(batches.lengths)))
    if not beside:  # which tells all that the others would, and has no such long tails
        if all(stream.between is not None for stream in scenario.demand):
            variates |= _products(batches, scenario, look)
        variates["look_square"] = batches.total(square, sample.served)
    return variates | {f"events@{name}": count for name, count in list(counts.items())[1:]}


def inputs(batches: Batches, scenario: TimedScenario) -> dict[str, tuple[Floats, Floats]]:
    """Return the observed and expected inputs: number of events and looking times.

    A control removes the randomness of the inputs; the inputs themselves are checked separately:
    their means, and their shapes by one value of the Laplace transform. That is a mean of
    numbers between 0 and 1, so that even long tails leave it an honest error.
    """
    variates: dict[str, tuple[Floats, Floats]] = {}
    sample = batches.sample
    for name, surplus in _counts(batches, scenario).items():
        number = scenario.stream_names.index(name)
        came = batches.count(sample.stream == number)
        variates[f"events of {name}"] = came, came - surplus
        law = scenario.demand[number].between
        assert law is not None
        gaps, is_seen = _gaps(sample, number)
        variates[f"gaps of {name}, transform"] = _transforms(batches, [(law, gaps, is_seen)])
    took = np.where(sample.served, sample.confirmed - sample.arrived, 0.0)
    looks = batches.total(took, sample.served)
    expected = looks - batches.total(_looks(sample, scenario)[0], sample.served)
    if expected.any():
        variates["looking"] = looks, expected
        laws = _look_law_of(sample, scenario)
        each = [(law, took, which) for law, which in laws if law.variance > 0]
        if each:
            variates["looking, transform"] = _transforms(batches, each)
    return variates


def _transforms(
    batches: Batches, parts: list[tuple[Law, Floats, NDArray[np.bool_]]]
) -> tuple[Floats, Floats]:
    """Sum of exp(-time / mean) over some times, and its expectation under their laws."""
    seen = expected = np.zeros(len(batches.lengths))
    for law, times, which in parts:
        seen = seen + batches.total(np.exp(-times / law.mean), which)
        expected = expected + _transform(law) * batches.count(which)
    return seen, expected


@cache
def _transform(law: Law) -> float:
    return laplace(law, 1 / law.mean)


def _gaps(sample: Sample, number: int) -> tuple[Floats, NDArray[np.bool_]]:
    """Return times from the event before of the same stream, and where they are known."""
    gaps = np.zeros(len(sample.stream))
    is_seen = np.zeros(len(sample.stream), dtype=bool)
    places = np.flatnonzero(sample.stream == number)[1:]
    gaps[places] = np.diff(sample.detected[sample.stream == number])
    is_seen[places] = True
    return gaps, is_seen


def _counts(batches: Batches, scenario: TimedScenario) -> dict[str, Floats]:
    """Return the number of events of each stream above the expectation from its intervals."""
    surpluses = {}
    for number, (name, stream) in enumerate(
        zip(scenario.stream_names, scenario.demand, strict=True)
    ):
        if stream.between is not None and stream.between.variance > 0:
            came = batches.count(batches.sample.stream == number)
            surpluses[name] = came - batches.lengths / stream.between.mean
    return surpluses


def _look_law_of(
    sample: Sample, scenario: TimedScenario
) -> Iterator[tuple[Law, NDArray[np.bool_]]]:
    """Yield each law of looking times, with a mask of the inspected events that follow it."""
    groups = {group.name: group.look for group in scenario.responders}
    for number, stream in enumerate(scenario.demand):
        for unit, group in enumerate(sample.groups):
            law: Law = stream.look if stream.look is not None else groups[group]
            yield law, sample.served & (sample.stream == number) & (sample.unit == unit)


def _looks(sample: Sample, scenario: TimedScenario) -> tuple[Floats, Floats]:
    """Return the excess of each look over its mean, and of its square; 0 without a look."""
    surplus = np.zeros(len(sample.stream))
    square = np.zeros(len(sample.stream))
    took = sample.confirmed - sample.arrived
    for law, which in _look_law_of(sample, scenario):
        surplus[which] = took[which] - law.mean
        square[which] = surplus[which] ** 2 - law.variance
    return surplus, square


def _beside(batches: Batches, scenario: TimedScenario) -> dict[str, Floats]:
    """Return waits, above their means, if one fast server had served the same events.

    None where not all events are served, or where no formula knows that server's waits.
    """
    sample = batches.sample
    dispatch = scenario.dispatch
    limited = dispatch.escalate_after_s is not None or dispatch.most_waiting is not None
    limited |= any(stream.patience is not None for stream in scenario.demand)
    lookers = len(sample.units) if len(set(sample.kinds)) == 1 else sample.kinds.count("robot")
    pace = (FASTER if lookers == 1 else 1.0) / lookers
    by_rank = dispatch.policy == "priority_eta" and dispatch.options.get("ageing_per_s") == 0
    if limited or scenario.way != "none":
        return {}
    ranks = _ranks(scenario) if by_rank else [0] * len(scenario.demand)
    means = _means(scenario, pace, ranks)
    if means is None:
        return {}
    looks = pace * (sample.confirmed - sample.arrived)
    waits = one_server(sample.detected, looks, np.array(ranks)[sample.stream])
    surplus = waits - np.array(means)[sample.stream]
    every = {f"beside@{n}": sample.stream == n for n in range(len(means))}
    return {name: batches.total(surplus, which) for name, which in every.items()}


def _ranks(scenario: TimedScenario) -> list[int]:
    """Return the rank of each stream, the most severe first."""
    severities = [stream.severity for stream in scenario.demand]
    levels = sorted({s for s in severities if isinstance(s, float)}, reverse=True)
    return [levels.index(s) if isinstance(s, float) else 0 for s in severities]


def _means(scenario: TimedScenario, pace: float, ranks: list[int]) -> list[float] | None:
    """Mean wait of each stream at one server that takes `pace` of its time for everything."""
    laws = _look_laws(scenario)
    between = [s.between for s in scenario.demand]
    if laws is None:
        return None
    if len(laws) == 1 and isinstance(laws[0], Exponential) and between[0] is not None:
        if laws[0].mean * pace >= between[0].mean:
            return None
        return [gm1(between[0], laws[0].mean * pace)["wait_s"]]
    if not all(isinstance(law, Exponential) for law in between):
        return None
    rates = [1 / law.mean for law in between if law is not None]
    scaled = [LawMoments(law.mean * pace, law.second * pace**2) for law in laws]
    if sum(r * law.mean for r, law in zip(rates, scaled, strict=True)) >= 1:
        return None
    if len(set(ranks)) < len(ranks):  # one queue for all
        means = cobham(rates, scaled)
        ahead = sum(r * law.second for r, law in zip(rates, scaled, strict=True)) / 2
        return [ahead / (1 - means["utilisation"])] * len(rates)
    order = sorted(range(len(ranks)), key=ranks.__getitem__)
    means = cobham([rates[n] for n in order], [scaled[n] for n in order])
    return [means[f"wait_{rank + 1}_s"] for rank in ranks]


def _look_laws(scenario: TimedScenario) -> list[Law] | None:
    """Return the law of the looking time for each stream; None if it depends on the responder."""
    robots = any(group.kind == "robot" for group in scenario.responders)
    kind = "robot" if robots else "guard"
    own = {group.look for group in scenario.responders if group.kind == kind}
    common = own.pop() if len(own) == 1 else None
    laws = [stream.look if stream.look is not None else common for stream in scenario.demand]
    return None if any(law is None for law in laws) else [law for law in laws if law is not None]


def _products(batches: Batches, scenario: TimedScenario, look: Floats) -> dict[str, Floats]:
    """Return surplus of each step of the queue times the faded surplus of the steps before."""
    from scipy.signal import lfilter

    rate = sum(1 / stream.between.mean for stream in scenario.demand if stream.between)
    gaps = np.diff(batches.sample.detected, prepend=np.nan) - 1 / rate
    step = np.concatenate([[0.0], look[:-1] / len(batches.sample.units)]) - gaps
    step[:1] = 0.0
    everything = np.ones(len(step), dtype=bool)
    products = {}
    for length in FADING:
        keep = 1 - 1 / length
        before = np.concatenate([[0.0], lfilter([1.0], [1.0, -keep], step)[:-1]])
        products[f"row_{length:g}"] = batches.total(step * before, everything)
    return products
