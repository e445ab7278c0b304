"""Laplace transforms of the laws that times can follow."""

from __future__ import annotations

import math

import numpy as np

from dva_sim.simulation.timed import distributions

_NODES = 128


def laplace(law: distributions.Law, s: float) -> float:
    """Return the expected value of `exp(-s X)`, for `s >= 0` [1/s].

    References:
        Kleinrock, Queueing Systems, vol. 1 (1975), appendix I. The lognormal and the Weibull
        law have no closed form: they are integrated over the chance they are made from.
    """
    if isinstance(law, distributions.Constant):
        return math.exp(-s * law.mean_s)
    if isinstance(law, distributions.Exponential):
        return 1 / (1 + s * law.mean_s)
    if isinstance(law, distributions.Uniform):
        width = s * (law.high_s - law.low_s)
        return math.exp(-s * law.low_s) * (-math.expm1(-width) / width if width else 1.0)
    if isinstance(law, distributions.Erlang):
        return (1 + s * law.mean_s / law.phases) ** -law.phases
    if isinstance(law, distributions.Gamma):
        return float((1 + s * law.mean_s / law.shape) ** -law.shape)
    if isinstance(law, distributions.Hyperexponential):
        # times the mean
        fast = 0.5 / law.share
        slow = 0.5 / (1 - law.share)
        rest = 1 - law.share
        return law.share / (1 + s * law.mean_s * fast) + rest / (1 + s * law.mean_s * slow)
    if isinstance(law, distributions.Lognormal):
        return _over_normal(law, s)
    return _over_exponential(law, s)


def _over_normal(law: distributions.Lognormal, s: float) -> float:
    """Return the mean over a standard normal number, of which the time is the exponential."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(_NODES)
    times = law.median * np.exp(law.spread * nodes)
    return float(weights @ np.exp(-s * times) / weights.sum())


def _over_exponential(law: distributions.Weibull, s: float) -> float:
    """Return the mean over a unit exponential number, of which the time is a power."""
    scale = law.mean_s / math.gamma(1 + 1 / law.shape)
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    ends = np.array([0.0, 1e-6, 1e-4, 1e-2, 0.1, 0.5, 1, 2, 4, 8, 16, 32, 64])
    starts = ends[:-1, None]
    widths = np.diff(ends)[:, None]
    e = starts + widths * (nodes + 1) / 2
    inner = np.exp(-s * scale * e ** (1 / law.shape) - e)
    return float((widths[:, 0] / 2) @ (inner @ weights))
