"""Positions in messages."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Position:
    """A place on the WGS-84 ellipsoid, in degrees."""

    latitude: float
    longitude: float
