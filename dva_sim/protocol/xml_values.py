"""Values as XML: a check for each simple type of `protocol/dva.xsd`, made from that type.

What passes is written; what the schema cannot hold raises `ProtocolError`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache
from typing import TypeVar

from dva_sim.protocol import limits
from dva_sim.protocol import messages as m
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.limits import bounds, choices, length

_T = TypeVar("_T")


def bad(reason: str) -> ProtocolError:
    """What to raise about a value that no message can hold."""
    return ProtocolError(m.BAD_MESSAGE, reason)


def _real(name: str, kind: str) -> Callable[[float], str]:
    low, high = bounds(kind)

    def write(value: float) -> str:
        if low <= value <= high:
            # float() because a numpy scalar spells its own type in its repr; 0.0 for -0.0, which
            # no reader expects of a speed.
            return repr(float(value) + 0.0)
        raise bad(f"{name} must be within {low:g} and {high:g}, not {value!r}")

    return write


def _integer(name: str, kind: str) -> Callable[[int], str]:
    low, high = bounds(kind)

    def write(value: int) -> str:
        if low <= value <= high:
            return f"{value:d}"
        raise bad(f"{name} must be within {low} and {high}, not {value!r}")

    return write


def optional(element: str, write: Callable[[_T], str], value: _T | None) -> str:
    """An element around a value; nothing for None."""
    return "" if value is None else f"<{element}>{write(value)}</{element}>"


def _escape(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _string(name: str, pattern: str, form: str) -> Callable[[str], str]:
    match = re.compile(pattern).fullmatch

    @lru_cache(maxsize=1024)
    def write(value: str) -> str:
        if match(value):
            return _escape(value)
        raise bad(f"{name} must be {form}, not {value!r}")

    return write


def _text_of(name: str, kind: str, form: str) -> Callable[[str], str]:
    """Text that has a length; `form` says what characters it has."""
    least, most_ = length(kind)
    told = f"{least} to {most_} {form}" if least else f"up to {most_} {form}"
    return _string(name, f"(?=(?s:.{{{least},{most_}}})\\Z){limits.pattern(kind)}", told)


def _choice(name: str, kind: str) -> Callable[[str], str]:
    return _string(name, "|".join(choices(kind)), " or ".join(choices(kind)))


device_id = _string("an id", limits.pattern("DeviceID"), "like 70:1A:04:F9:81:D6")
clock = _string("Timestamp", limits.pattern("Timestamp"), "HH:MM:SS")
name = _text_of("a name", "Name", "printable characters")
text = _text_of("Text", "Text", "printable characters")
address = _string("IpAddr", limits.pattern("Address"), "like 192.168.1.48 or with :port")
url = _text_of("CameraUrl", "Url", "ASCII characters without spaces")
mode = _choice("Mode", "Mode")
level = _choice("Level", "Level")
kind = _choice("Kind", "EventKind")
finding = _choice("Finding", "Finding")
task = _choice("Task", "Task")
mission_state = _choice("MissionState", "MissionState")
state = _choice("State", "OrderState")
takeover = _choice("Takeover", "Takeover")
event_state = _choice("EventState", "EventState")
dispatch_mode = _choice("DispatchMode", "DispatchMode")
role = _choice("Role", "Role")

message_id = _integer("MessageID", "Positive")
answers = _integer("Answers", "Natural")
session_id = _integer("SessionID", "SessionID")
session = _integer("Session", "Session")
event_id = _integer("EventID", "Positive")
code = _integer("Code", "Code")
tick = _integer("a tick", "Tick")
mission_id = _integer("MissionID", "Natural")
decisions = _integer("Decisions", "Natural")
laps = _integer("Laps", "Laps")
waypoints_left = _integer("WaypointsLeft", "WaypointsLeft")

speed = _real("Speed", "Speed")
turn_rate = _real("TurnRate", "TurnRate")
heading = _real("Heading", "Heading")
latitude = _real("Latitude", "Latitude")
longitude = _real("Longitude", "Longitude")
unit = _real("Severity and Confidence", "Fraction")
frequency = _real("Frequency", "Frequency")
duration = _real("a duration", "Duration")
measured = _real("Value", "Measured")


def position(at: m.Position, tag: str = "Position") -> str:
    """A place, as an element of that name."""
    return (
        f"<{tag}><Latitude>{latitude(at.latitude)}</Latitude>"
        f"<Longitude>{longitude(at.longitude)}</Longitude></{tag}>"
    )
