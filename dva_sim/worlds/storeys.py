"""Storeys of a plan, by the property `level` of its features, as in OpenStreetMap."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

LEVEL: Final = "level"
_REPEATED: Final = "repeat_on"  # further storeys of the same feature
_RANGE: Final = re.compile(r"(-?\d+)-(-?\d+)")


def label_of(level: object) -> str:
    """Return a storey's name: `0` for 0, `0.0` and `"0"`."""
    text = str(level).strip()
    try:
        return f"{float(text):g}"
    except ValueError:
        return text


def parse_storeys(properties: Mapping[str, Any]) -> frozenset[str]:
    """Return the storeys that a feature is on, such as 0 and 1 for `0;1`; empty for all."""
    labels = set[str]()
    for key in (LEVEL, _REPEATED) if properties.get(LEVEL) not in (None, "") else ():
        value = properties.get(key)
        for part in "" if value is None else str(value).split(";"):
            bounds = _RANGE.fullmatch(part.strip())
            if bounds:
                labels |= set(map(str, range(int(bounds[1]), int(bounds[2]) + 1)))
            elif part.strip():
                labels.add(label_of(part))
    return frozenset(labels)


def to_choose_from(features: Iterable[frozenset[str]]) -> list[str]:
    """Return the storeys among which a plan has to choose; empty if all features share one."""
    on = [storeys for storeys in features if storeys]
    if not on or frozenset.intersection(*on):
        return []
    return sorted(frozenset.union(*on), key=_by_height)


def _by_height(label: str) -> tuple[bool, float, str]:
    try:
        return False, float(label), ""
    except ValueError:
        return True, 0.0, label
