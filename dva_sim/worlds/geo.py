"""Positions on the ground: a local east-north plane tangent to the WGS-84 ellipsoid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from dva_sim.kernel.makers import maker

# WGS-84: semi-major axis [m] and first eccentricity squared.
_A = 6_378_137.0
_F = 1 / 298.257223563
_E2 = _F * (2 - _F)


class Pose(NamedTuple):
    """Position [m] and heading [rad], counter-clockwise from x (east)."""

    x: float
    y: float
    heading: float


make_pose = maker(Pose)


@dataclass(frozen=True)
class GeoFrame:
    """A plane that touches the earth at one point: x east, y north [m].

    Points are taken to lie on the ellipsoid (height 0), which makes the plane and
    geographic coordinates one-to-one near the origin.

    Attributes:
        latitude: Latitude of the origin [deg].
        longitude: Longitude of the origin [deg].

    References:
        EPSG Guidance Note 7-2, "Geographic/topocentric conversions".
    """

    latitude: float
    longitude: float

    @cached_property
    def _origin(self) -> tuple[float, float, float]:
        """Sine and cosine of its latitude, and the radius of curvature there, eastwards [m]."""
        phi = math.radians(self.latitude)
        return math.sin(phi), math.cos(phi), _A / math.sqrt(1 - _E2 * math.sin(phi) ** 2)

    @cached_property
    def _degrees(self) -> tuple[float, float]:
        """Degrees of longitude and of latitude for each metre east and north."""
        sin, cos, normal = self._origin
        meridian = normal * (1 - _E2) / (1 - _E2 * sin**2)
        return math.degrees(1 / (normal * cos)), math.degrees(1 / meridian)

    def distance(self, latitude: float, longitude: float) -> float:
        """Return how far a geographic position [deg] is from the origin, through the earth [m].

        The plane does not tell: to it the other side of the earth is as near as this one.
        """
        sin_0, cos_0, _ = self._origin
        phi = math.radians(latitude)
        along = math.radians(longitude - self.longitude)
        cosine = sin_0 * math.sin(phi) + cos_0 * math.cos(phi) * math.cos(along)
        return _A * math.sqrt(max(0.0, 2 - 2 * cosine))

    def to_xy(self, latitude: float, longitude: float) -> tuple[float, float]:
        """Return the plane coordinates [m] of a geographic position [deg]."""
        sin_0, cos_0, normal_0 = self._origin
        phi = math.radians(latitude)
        along = math.radians(longitude) - math.radians(self.longitude)
        sin = math.sin(phi)
        cos = math.cos(phi)
        normal = _A / math.sqrt(1 - _E2 * sin * sin)
        out = normal * cos * math.cos(along)
        up = (1 - _E2) * (normal * sin - normal_0 * sin_0)
        return normal * cos * math.sin(along), cos_0 * up - sin_0 * (out - normal_0 * cos_0)

    def to_latlon(self, x: float, y: float) -> tuple[float, float]:
        """Return the latitude and longitude [deg] of a point of the plane [m].

        Inverts `to_xy` by fixed-point steps; each gains about three digits within 3 km.
        """
        latitude = self.latitude
        longitude = self.longitude
        east = x
        north = y
        for _ in range(4):
            longitude += east * self._degrees[0]
            latitude += north * self._degrees[1]
            x_now, y_now = self.to_xy(latitude, longitude)
            east = x - x_now
            north = y - y_now
            if abs(east) + abs(north) < 1e-6:
                break
        return latitude, longitude
