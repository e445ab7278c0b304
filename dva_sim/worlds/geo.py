"""Positions on the ground: a local east-north plane tangent to the WGS-84 ellipsoid."""

from __future__ import annotations

import math
from typing import NamedTuple

# WGS-84: semi-major axis [m] and first eccentricity squared.
_A = 6_378_137.0
_F = 1 / 298.257223563
_E2 = _F * (2 - _F)


class Pose(NamedTuple):
    """Position [m] and heading [rad], counter-clockwise from x (east)."""

    x: float
    y: float
    heading: float


class GeoFrame:
    """A plane that touches the earth at one point: x east, y north [m].

    Points are taken to lie on the ellipsoid (height 0), which makes the plane and
    geographic coordinates one-to-one near the origin.

    Args:
        latitude: Of the origin [deg].
        longitude: Of the origin [deg].

    References:
        EPSG Guidance Note 7-2, "Geographic/topocentric conversions".
    """

    def __init__(self, latitude: float, longitude: float) -> None:
        self.latitude = latitude
        self.longitude = longitude
        phi = math.radians(latitude)
        self._lambda = math.radians(longitude)
        self._sin, self._cos = math.sin(phi), math.cos(phi)
        w2 = 1 - _E2 * self._sin**2
        self._normal = _A / math.sqrt(w2)
        meridian = self._normal * (1 - _E2) / w2
        self._degrees_north = math.degrees(1 / meridian)
        self._degrees_east = math.degrees(1 / (self._normal * self._cos))

    def to_xy(self, latitude: float, longitude: float) -> tuple[float, float]:
        """Plane coordinates [m] of a geographic position [deg]."""
        phi, along = math.radians(latitude), math.radians(longitude) - self._lambda
        sin, cos = math.sin(phi), math.cos(phi)
        normal = _A / math.sqrt(1 - _E2 * sin * sin)
        out = normal * cos * math.cos(along)
        up = (1 - _E2) * (normal * sin - self._normal * self._sin)
        north = self._cos * up - self._sin * (out - self._normal * self._cos)
        return normal * cos * math.sin(along), north

    def to_latlon(self, x: float, y: float) -> tuple[float, float]:
        """Latitude and longitude [deg] of a point of the plane [m].

        Inverts `to_xy` by fixed-point steps; each gains about three digits within 3 km.
        """
        latitude, longitude = self.latitude, self.longitude
        east, north = x, y
        for _ in range(4):
            latitude += north * self._degrees_north
            longitude += east * self._degrees_east
            x_now, y_now = self.to_xy(latitude, longitude)
            east, north = x - x_now, y - y_now
            if abs(east) + abs(north) < 1e-6:
                break
        return latitude, longitude

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, GeoFrame):
            return NotImplemented
        return (self.latitude, self.longitude) == (other.latitude, other.longitude)

    def __hash__(self) -> int:
        return hash((self.latitude, self.longitude))

    def __repr__(self) -> str:
        return f"GeoFrame({self.latitude}, {self.longitude})"
