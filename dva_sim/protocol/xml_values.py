"""Values as XML: a check for each simple type of `protocol/dva.xsd`, made from that type.

Valid values are written; values that the schema cannot hold raise `ProtocolError`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Final

from dva_sim.protocol import limits
from dva_sim.protocol import messages as m
from dva_sim.protocol.errors import ProtocolError

Write = Callable[[Any], str]

_FORMS: Final = {
    "DeviceID": "like 70:1A:04:F9:81:D6",
    "Timestamp": "HH:MM:SS",
    "Address": "like 192.168.1.48 or with :port",
    "Name": "printable characters",
    "Text": "printable characters",
    "Url": "ASCII characters without spaces",
}
"""Texts of each type in words, without their length."""


def bad(reason: str) -> ProtocolError:
    """Return the error to raise about a value that no message can hold."""
    return ProtocolError(m.BAD_MESSAGE, reason)


def writer(element: str, kind: str) -> Write:
    """Return what writes a value of a simple type as the text of an element of that name."""
    known = limits.facets(kind)
    base = known["base"][0]
    if "enumeration" in known:
        words = known["enumeration"]
        return _text(element, "|".join(words), " or ".join(words))
    if base == "xs:string":
        if "maxLength" not in known:
            return _text(element, limits.pattern(kind), _FORMS[kind])
        least, most = limits.length(kind)
        form = f"{least} to {most} {_FORMS[kind]}" if least else f"up to {most} {_FORMS[kind]}"
        return _text(element, f"(?=(?s:.{{{least},{most}}})\\Z){limits.pattern(kind)}", form)
    return _integer(element, kind) if base in limits.WHOLE else _real(element, kind)


def _real(element: str, kind: str) -> Write:
    low, high = limits.bounds(kind)

    def write(value: float) -> str:
        if low <= value <= high:
            # float() because a numpy scalar spells its own type in its repr; 0.0 for -0.0, which
            # no reader expects of a speed.
            return repr(float(value) + 0.0)
        raise bad(f"{element} must be within {low:g} and {high:g}, not {value!r}")

    return write


def _integer(element: str, kind: str) -> Write:
    low, high = limits.bounds(kind)

    def write(value: int) -> str:
        if low <= value <= high:
            return f"{value:d}"
        raise bad(f"{element} must be within {low} and {high}, not {value!r}")

    return write


def _text(element: str, pattern: str, form: str) -> Write:
    match = re.compile(pattern).fullmatch

    @lru_cache(maxsize=256)
    def write(value: str) -> str:
        if match(value):
            return value.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
        raise bad(f"{element} must be {form}, not {value!r}")

    return write
