"""The earliest possible responses of a run, and how near the policy came to them.

**The bound of an event** is the response if the best unit for it stood idle at its base, or at a
station, at the moment of the report: no queue, no limit of operators, nothing to wait for; with
the event's own random numbers. No policy beats it with units that set out from a base or a station.

It is *not* a bound for who is out already: walking back, redirected on the way, or going on from
one event to the next, one may be nearer than any base and needs no time to get ready. Nor where
two reports are one event to the DVA, and somebody is there already. How often that happens is
counted in every run (`beats_bound_share`), so that a reader sees what the bound is worth.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.core.dispatch import load_policy
from dva_sim.simulation.timed.incidents import Incident
from dva_sim.simulation.timed.recording import TimedRecording
from dva_sim.simulation.timed.responders import Unit
from dva_sim.simulation.timed.simulation import Shift
from dva_sim.simulation.timed.travel import Place
from dva_sim.statistics import Band, band

Floats = NDArray[np.float64]


def evenness(amounts: ArrayLike) -> float:
    """Return Jain's index of fairness: 1 if all have the same, 1 / n if one has everything.

    Nan where there is nothing to share, or nobody.

    References:
        R. Jain, D. Chiu and W. Hawe, A quantitative measure of fairness and discrimination for
        resource allocation in shared computer systems, DEC-TR-301, 1984.
    """
    shares = np.asarray(amounts, dtype=float)
    squares = float((shares**2).sum())
    return float(shares.sum() ** 2 / (len(shares) * squares)) if squares > 0 else float("nan")


def response_bounds(recording: TimedRecording) -> Floats:
    """Return the bound of each event of a run [s], in the order of its rows, shape `(n,)`."""
    scenario = recording.scenario
    shift = Shift(scenario, recording.seed, load_policy("min_eta"))
    stations = list(shift.stations.values())
    streams = recording.columns["stream"]
    indices = recording.columns["index"]
    incidents = [
        _incident(shift, int(stream), int(index))
        for stream, index in zip(streams, indices, strict=True)
    ]
    return np.array([_best(shift, incident, stations) for incident in incidents], dtype=float)


def _incident(shift: Shift, stream: int, index: int) -> Incident:
    """Return an incident again, as far as its way matters."""
    draws = shift.demand.draws[stream]
    kind = shift.scenario.demand[stream].kind
    place = draws.place(index)
    return Incident(
        stream=stream,
        index=index,
        number=0,
        kind=kind,
        place=place,
        true=True,
        severity=0.5,
        confidence=0.5,
        occurred=0.0,
    )


def _best(shift: Shift, incident: Incident, stations: list[Place]) -> float:
    return min(
        shift.mobilisation(unit, incident) + shift.trip(unit, start, incident.place)
        for unit in shift.units
        for start in _starts(unit, stations)
    )


def _starts(unit: Unit, stations: list[Place]) -> list[Place]:
    """Return where a unit may wait; guards also at stations."""
    return [unit.base, *stations] if unit.kind == "guard" else [unit.base]


def share_of_the_way(floor: Floats, reached: Floats, bound: Floats) -> Band:
    """Return how far policies get from a floor to a bound: 0 at the floor, 1 at the bound.

    The share is `mean(floor - reached) / mean(floor - bound)` over shifts, each paired with itself.
    Its interval is that of a ratio of means by linearisation; the band holds for all columns at
    once.

    Args:
        floor: Value of the policy that the others must beat, by shift, shape `(shifts,)` or as
            `reached`.
        reached: Value of each policy, shape `(shifts, k)`.
        bound: The best possible, shape as of `floor`.

    References:
        W. G. Cochran, Sampling Techniques, 3rd ed., 1977, section 6.3: the ratio estimator and
        its variance.
    """
    floor, bound = (np.broadcast_to(np.atleast_2d(x.T).T, reached.shape) for x in (floor, bound))
    is_finite = np.isfinite(floor) & np.isfinite(reached) & np.isfinite(bound)
    gained = np.where(is_finite, floor - reached, np.nan)
    whole = np.where(is_finite, floor - bound, np.nan)
    count = np.maximum(is_finite.sum(axis=0), 1)
    mean_gained, mean_whole = (np.nansum(x, axis=0) / count for x in (gained, whole))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(mean_whole > 0, mean_gained / mean_whole, np.nan)
        return band(share + (gained - share * whole) / mean_whole)
