"""Units of columns and keys, which are stated only by the endings of their names."""

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
"""Units as printed, by the ending of a name."""


def ending_of(name: str) -> str:
    """Return the longest ending that is a unit: `s` for `link.delay_s`, "" for `pattern`."""
    words = name.rpartition(".")[2].split("_")[1:]
    endings = ("_".join(words[start:]) for start in range(len(words)))
    return next((ending for ending in endings if ending in UNITS), "")


def unit_of(name: str) -> str:
    """Return the unit that a name ends in, as printed: `s` for `link.delay_s`."""
    return UNITS.get(ending_of(name), "")


"""Factors from other units to the unit of a key, by the key's ending."""
