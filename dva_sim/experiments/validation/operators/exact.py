"""Answers that nobody measured on persons: theory, the dissertation's app, standards."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.experiments.validation.operators import loops, median, standards

Values = dict[str, float]

SMITH = 4.0, 0.5, 1.5  # gain [1/s], delay [s] and time of the look at it [s]

EXACT: dict[str, Callable[[int], Values]] = {
    "S1": lambda seed: {"critical": loops.critical(loops.integrator, 1.0, 2.2)},
    "S2": lambda seed: {"critical": loops.critical(loops.pure_pursuit, 0.3, 0.8)},
    "S3": lambda seed: {"response": loops.smith_response(*SMITH)[-1]},
    "S4": lambda seed: median.ages(),
    "S5": lambda seed: median.steps(),
    "S6": median.smoothing,
    "S16": lambda seed: standards.fires(),
    "S16b": standards.helpers,
    "S16c": lambda seed: standards.alarms(),
    "S16d": standards.walkers,
    "S16e": lambda seed: standards.plumes(),
}
"""How each exact check is simulated, given the seed of all luck."""
