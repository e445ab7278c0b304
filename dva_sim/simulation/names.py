"""Ids on the wire and names for people."""

from __future__ import annotations

DVA = "02:00:00:00:00:01"
_ROOMS = {"dva": 0, "robot": 1, "guard": 2, "operator": 3, "detector": 4}


def id_of(kind: str, number: int) -> str:
    """The id of the `number`-th device of a kind, from 1: locally administered, never random."""
    return f"02:00:00:{_ROOMS[kind]:02X}:{number >> 8:02X}:{number & 0xFF:02X}"


def label_of(kind: str, number: int) -> str:
    """Its name for people: `robot-1`; of the DVA there is but one."""
    return "dva" if kind == "dva" else f"{kind}-{number}"


def address_of(kind: str, number: int) -> str:
    """Its address in the registration, where nobody has a real one."""
    return f"192.168.{_ROOMS[kind] or 1}.{number % 250 + 1}"
