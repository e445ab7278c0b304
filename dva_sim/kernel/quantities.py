"""Conversion of numbers written with a unit to the plain number that a file expects."""

from __future__ import annotations

import re
from typing import Final

_NUMBER: Final = r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?"
_QUANTITY: Final = re.compile(rf"({_NUMBER})\s*([^\d\s]*)", re.IGNORECASE)
_UNITS: Final[dict[str, dict[str, float]]] = {
    "s": {"ms": 1e-3, "us": 1e-6, "µs": 1e-6, "s": 1, "sec": 1, "min": 60, "h": 3600},
    "m": {"mm": 1e-3, "cm": 1e-2, "m": 1, "km": 1000},
    "mps": {"m/s": 1, "mps": 1, "km/h": 1 / 3.6, "kmh": 1 / 3.6},
    "hz": {"hz": 1, "khz": 1000},
    "bps": {
        "bps": 1,
        "bit/s": 1,
        "kbps": 1e3,
        "kbit/s": 1e3,
        "mbps": 1e6,
        "mbit/s": 1e6,
        "gbps": 1e9,
        "gbit/s": 1e9,
    },
    "bytes": {"b": 1, "byte": 1, "bytes": 1, "kb": 1e3, "mb": 1e6, "kib": 1024, "mib": 2**20},
    "deg": {"°": 1, "deg": 1},
    "rad": {"rad": 1},
    "": {"%": 0.01},
}


def as_number(key: str, text: str) -> str:
    """Suggest the number for a text with a unit, such as `0.5` for `500ms`; empty if unclear."""
    match = _QUANTITY.fullmatch(text.strip())
    if match is None:
        return ""
    value = float(match[1].replace(",", "."))
    unit = match[2].casefold()
    ending = key.rpartition("_")[2]
    factors = _UNITS.get(ending, _UNITS[""]) if "_" in key else _UNITS[""]
    factor = 1.0 if not unit else factors.get(unit)
    return "" if factor is None else f"{value * factor:.12g}"
