"""The dissertation's filter on its own: how old its values are, and how it freezes and ratchets.

The app takes the value when 20 samples have come or the longest delay has passed, and what it
takes stands until the next time. Samples come evenly; the filters are those of the phone.
"""

from __future__ import annotations

import numpy as np

from dva_sim.agents.tilt.filters import BATCH, Filter, load_filter
from dva_sim.kernel.streams import Streams

Values = dict[str, float]
RATE = 34.0  # samples per second: 17 in 500 ms, as its tablet managed
COPY = "median20-copy"
IN_PLACE = "median20-inplace"
STEP_LOOK = 0.2  # [s]
STEP_LEVELS = [2.0] * 102 + [8.0] * 102 + [2.0] * 204  # 3 s, 3 s, 6 s
BATCHES = 20_000  # number of batches of noise


def ages() -> Values:
    """Mean age of the command in force, with a longest delay of 0.5 s [s].

    The input rises steadily, so what is in force tells from when it is. `clean`: the median over
    the fresh samples alone. `stale`: over the whole buffer, 3 of whose 20 slots are not fresh.
    """
    fresh = round(0.5 * RATE)
    clean = load_filter("median", {"window": fresh})(1.0 / RATE)
    stale = load_filter(COPY)(1.0 / RATE)
    return {"clean": _mean_age(clean, 0.5), "stale": _mean_age(stale, 0.5)}


def steps() -> Values:
    """Outputs of both variants for a level of 2, then 8, then 2, with a maximum delay of 0.2 s."""
    copy = step_outputs(COPY)
    in_place = step_outputs(IN_PLACE)
    return {"copy": max(copy), "rises": max(in_place), "never-returns": in_place[-1]}


def step_outputs(name: str) -> list[float]:
    """Return outputs of a filter for those levels, one per `STEP_LOOK`."""
    return _outputs(load_filter(name)(1.0 / RATE), STEP_LEVELS, STEP_LOOK)


def smoothing(seed: int) -> Values:
    """Standard deviation of white noise behind a median of 20 fresh samples, before it being 1."""
    noise = Streams(seed).fresh("noise").normal(size=BATCHES * BATCH)
    outputs = _outputs(load_filter(COPY)(1.0 / RATE), noise.tolist(), BATCH / RATE)
    return {"ratio": float(np.std(outputs))}


def _mean_age(filter_: Filter, longest: float) -> float:
    """Return the mean age on a ramp of 1 per second, over whole periods between two reads [s]."""
    samples = [n / RATE for n in range(1, round(40 * RATE) + 1)]
    values = _outputs(filter_, samples, longest)
    period = _period(longest)
    taken = [period * (look + 1) for look in range(len(values))]
    old = [then + 0.5 * period - value for then, value in zip(taken, values, strict=True)]
    return float(np.mean(old[5:]))


def _outputs(filter_: Filter, samples: list[float], longest: float) -> list[float]:
    """Return the value at each look at the filter."""
    values = []
    due = 0
    looks = 1
    while due < len(samples):
        end = int(looks * _period(longest) * RATE + 1e-9)
        for sample in samples[due:end]:
            filter_.add((sample, 0.0))
        values.append(filter_.value()[0])
        due = end
        looks += 1
    return values


def _period(longest: float) -> float:
    """Return the period between two reads of the filter [s]."""
    return min(longest, BATCH / RATE)
