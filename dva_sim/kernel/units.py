"""The unit of a column or key is the end of its name, and nothing else says it."""

from __future__ import annotations

UNITS = {
    "s": "s",
    "m": "m",
    "rad": "rad",
    "deg": "deg",
    "hz": "Hz",
    "mps": "m/s",
    "rad_s": "rad/s",
    "deg_s": "deg/s",
    "n_s": "N s",
    "bits": "bit",
    "bytes": "B",
    "bps": "bit/s",
    "mps2": "m/s^2",
    "m2": "m^2",
    "c": "deg C",
    "k": "K",
    "kw_m2": "kW/m^2",
    "per_m": "1/m",
    "per_min": "per min",
    "s_per_bit": "s/bit",
    "s_per_h": "s/h",
}
"""Endings of names, with the unit as it is printed."""


def ending_of(name: str) -> str:
    """Return the longest ending that is a unit: `s` of `link.delay_s`, nothing of `pattern`."""
    words = name.rpartition(".")[2].split("_")[1:]
    endings = ("_".join(words[start:]) for start in range(len(words)))
    return next((ending for ending in endings if ending in UNITS), "")


def unit_of(name: str) -> str:
    """Return the unit a name ends in, as printed: `link.delay_s` gives `s`, `pattern` nothing."""
    return UNITS.get(ending_of(name), "")


"""By the last part of a key, what one of a unit is in the key's own."""
