"""Gas outdoors: Gaussian plumes over flat ground.

How wide they are follows from the distance and from how stable the air is, classes A (sunny,
calm) to F (clear night). Fitted from 0.1 km on; nearer it is extrapolated: across by the same
power, upwards in proportion to the distance, as the fit's constant f would leave metres of gas
(classes A and B), or less than none (D to F), at the leak itself.

References:
    D. O. Martin, J. Air Pollut. Control Assoc. 26 (1976) 145: sigma = a x^0.894 across, c x^d + f
    upwards, x in km.
    D. B. Turner, Workbook of Atmospheric Dispersion Estimates, US EPA AP-26, 1970.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class Spread(NamedTuple):
    """Martin's constants of a class: `a` across; c, d, f upwards below and beyond 1 km."""

    a: float
    near: tuple[float, float, float]
    far: tuple[float, float, float]


CLASSES = {
    "A": Spread(213.0, (440.8, 1.941, 9.27), (459.7, 2.094, -9.6)),
    "B": Spread(156.0, (106.6, 1.149, 3.3), (108.2, 1.098, 2.0)),
    "C": Spread(104.0, (61.0, 0.911, 0.0), (61.0, 0.911, 0.0)),
    "D": Spread(68.0, (33.2, 0.725, -1.7), (44.5, 0.516, -13.0)),
    "E": Spread(50.5, (22.8, 0.678, -1.3), (55.4, 0.305, -34.0)),
    "F": Spread(34.0, (14.35, 0.740, -0.35), (62.6, 0.180, -48.6)),
}
FITTED = 0.1  # shortest distance of the fits [km]


def sigma_y(stability: str, distance: float) -> float:
    """Return standard deviation across the wind [m] at a distance downwind [m]."""
    return float(CLASSES[stability].a * (distance / 1000.0) ** 0.894)


def sigma_z(stability: str, distance: float) -> float:
    """Return standard deviation upwards [m] at a distance downwind [m]."""
    spread = CLASSES[stability]
    x = max(FITTED, distance / 1000.0)
    c, d, f = spread.near if x <= 1.0 else spread.far
    return float(c * x**d + f) * distance / 1000.0 / x


def plume(rate: float, wind: float, stability: str, x: float, y: float, z: float) -> float:
    """Return the share of gas in the air downwind of a steady source on the ground.

    Args:
        rate: Gas set free [m^3/s].
        wind: [m/s]
        stability: A to F.
        x: Downwind of the source [m]; there is none upwind.
        y: Across [m].
        z: Above the ground, which throws back what reaches it [m].
    """
    if x <= 0.0:
        return 0.0
    across = sigma_y(stability, x)
    up = sigma_z(stability, x)
    shape = math.exp(-0.5 * (y / across) ** 2 - 0.5 * (z / up) ** 2)
    return min(1.0, rate / (math.pi * wind * across * up) * shape)
