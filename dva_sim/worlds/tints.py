"""Soft colours of floors seen from above, so that tracks and hazards stand out."""

from __future__ import annotations

import re

from dva_sim.worlds.site_parts import Room

FLOORS = ("#eef3f8", "#f6f1e7", "#edf4ec", "#f6edf0", "#f0eff7", "#eaf4f4")
CORRIDOR = "#fbfbf9"
PAVING = "#ece9e3"
GRASS = "#dfe9d4"


def floor_tint(room: Room, tints: dict[str, str]) -> str:
    """Return the colour of a room's floor; rooms of one purpose have one colour.

    Args:
        tints: Those of the rooms before it, by purpose; a new one is added.
    """
    if room.outdoor:
        return PAVING if room.paved else GRASS
    if "corridor" in room.name.lower():
        return CORRIDOR
    purpose = re.sub(r"\W*\b[A-Z]?\d*$", "", room.name)
    return tints.setdefault(purpose, FLOORS[len(tints) % len(FLOORS)])
