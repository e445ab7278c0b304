"""Points of continuous factors: Latin hypercubes, Sobol' sequences, and samples for Sobol' indices.

The same seed gives the same points. Values have six significant digits, so that the last bits of
a machine's logarithm do not make another configuration.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from dva_sim.experiments.asking import Level
from dva_sim.experiments.designs import Design, Span
from dva_sim.streams import derive_seed

Floats = NDArray[np.float64]

_DIGITS = 6


def sample(design: Design, seed: int) -> list[dict[str, Level]]:
    """The value of each continuous factor at each point, in order."""
    spans = design.ranges
    places = _places(design, len(spans), np.random.default_rng(derive_seed(seed, "design")))
    return [
        {key: value_at(span, float(u)) for (key, span), u in zip(spans.items(), place, strict=True)}
        for place in places
    ]


def _places(design: Design, axes: int, rng: np.random.Generator) -> Floats:
    """Points in the unit cube `(points, axes)`.

    References:
        McKay, Beckman & Conover, Technometrics 21 (1979), 239-245.
        Owen, Journal of Complexity 14 (1998), 466-489.
    """
    if design.latin_hypercube is not None:
        return np.asarray(qmc.LatinHypercube(axes, rng=rng).random(design.latin_hypercube))
    if design.sobol is not None:
        return _sobol(axes, design.sobol, rng)
    assert design.saltelli is not None
    return saltelli(axes, design.saltelli, rng)


def _sobol(axes: int, points: int, rng: np.random.Generator) -> Floats:
    return np.asarray(qmc.Sobol(axes, rng=rng).random_base2(int(math.log2(points))))


def saltelli(axes: int, base: int, rng: np.random.Generator) -> Floats:
    """Pairs of independent points A and B, and for each axis A with that coordinate of B.

    Returns:
        Points `(base * (axes + 2), axes)`, pair by pair: A, A with coordinate 0, 1, ... of B, B.

    References:
        Saltelli, Annoni, Azzini, Campolongo, Ratto & Tarantola, Computer Physics Communications
        181 (2010), 259-270.
    """
    both = _sobol(2 * axes, base, rng)
    first, second = both[:, :axes], both[:, axes:]
    blocks = np.repeat(first[:, np.newaxis], axes + 2, axis=1)
    for axis in range(axes):
        blocks[:, axis + 1, axis] = second[:, axis]
    blocks[:, -1] = second
    return blocks.reshape(-1, axes)


def value_at(span: Span, share: float) -> float | int:
    """What stands at a share of the way from `low` to `high`."""
    if span.scale == "whole":
        return min(int(span.high), math.floor(span.low + share * (span.high - span.low + 1)))
    if span.scale == "log":
        value = span.low * (span.high / span.low) ** share
    else:
        value = span.low + share * (span.high - span.low)
    return float(f"{value:.{_DIGITS}g}")
