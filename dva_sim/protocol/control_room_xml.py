"""What is said below `Dispatch`, to XML and back; used by `xml_writer` and `xml_reader`.

Elements stand in the order of the fields of their dataclasses, and what is None is absent, so
that one table of fields serves both ways. Names, order and form are validated before reading.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import fields
from typing import Any, Final, NamedTuple

from lxml import etree

from dva_sim.protocol import messages as m
from dva_sim.protocol import xml_values as v
from dva_sim.protocol.control_room import ControlRoomBody
from dva_sim.protocol.limits import most

Read = Callable[[etree._Element], Any]


class _Field(NamedTuple):
    """One field: its element, its value as XML, and the way back."""

    element: str
    write: Callable[[Any], str]
    read: Read


def _str(element: etree._Element) -> str:
    return element.text or ""


def _int(element: etree._Element) -> int:
    return int(element.text or "")


def _float(element: etree._Element) -> float:
    return float(element.text or "")


def _position(element: etree._Element) -> m.Position:
    return m.Position(_float(element[0]), _float(element[1]))


def _place(at: m.Position) -> str:
    return v.position(at).removeprefix("<Position>").removesuffix("</Position>")


_DURATION = (v.duration, _float)
_TEXT, _NAME, _ID = (v.text, _str), (v.name, _str), (v.device_id, _str)
_FIELDS: Final = {
    "event_id": _Field("EventID", v.event_id, _int),
    "kind": _Field("Kind", v.kind, _str),
    "position": _Field("Position", _place, _position),
    "severity": _Field("Severity", v.unit, _float),
    "confidence": _Field("Confidence", v.unit, _float),
    "event_state": _Field("EventState", v.event_state, _str),
    "age": _Field("Age", *_DURATION),
    "state_for": _Field("StateFor", *_DURATION),
    "closed_for": _Field("ClosedFor", *_DURATION),
    "ago": _Field("Ago", *_DURATION),
    "arrival_in": _Field("ArrivalIn", *_DURATION),
    "advised_in": _Field("AdvisedIn", *_DURATION),
    "decide_within": _Field("DecideWithin", *_DURATION),
    "decisions": _Field("Decisions", v.decisions, _int),
    "code": _Field("Code", v.code, _int),
    "waits_for": _Field("WaitsFor", v.task, _str),
    "task": _Field("Task", v.task, _str),
    "dispatch_mode": _Field("DispatchMode", v.dispatch_mode, _str),
    "role": _Field("Role", v.role, _str),
    "author": _Field("AuthorID", *_ID),
    "device": _Field("DeviceID", *_ID),
    "responder": _Field("ResponderID", *_ID),
    "operator": _Field("OperatorID", *_ID),
    "actor": _Field("ActorID", *_ID),
    "advised": _Field("AdvisedID", *_ID),
    "label": _Field("DeviceLabel", *_NAME),
    "action": _Field("Action", *_NAME),
    "policy": _Field("Policy", *_NAME),
    "reason": _Field("Reason", *_TEXT),
    "text": _Field("Text", *_TEXT),
    "note": _Field("Note", *_TEXT),
    "acknowledged": _Field(
        "Acknowledged", lambda said: _inside(said), lambda element: _read(m.ByWhom, element)
    ),
    "switched": _Field(
        "Switched", lambda said: _inside(said), lambda element: _read(m.ByWhom, element)
    ),
    "last_decision": _Field(
        "LastDecision", lambda said: _inside(said), lambda element: _read(m.LastDecision, element)
    ),
    "proposed": _Field(
        "Proposed", lambda said: _inside(said), lambda element: _read(m.Proposed, element)
    ),
}
_NAMES: Final = {field.element: name for name, field in _FIELDS.items()}
_MANY: Final = {  # of which there may be several, or none
    "candidates": ("Candidate", m.Candidate, most("Proposal", "Candidate")),
    "events": ("EventStatus", m.EventStatus, most("EventList", "EventStatus")),
}


def _inside(said: Any) -> str:
    """The elements of what a dataclass holds."""
    return "".join(_element(field.name, getattr(said, field.name)) for field in fields(said))


def _element(name: str, value: Any) -> str:
    if name in _MANY:
        return _several(name, value)
    if value is None:
        return ""
    element, write, _ = _FIELDS[name]
    return f"<{element}>{write(value)}</{element}>"


def _several(name: str, values: tuple[Any, ...]) -> str:
    element, _, limit = _MANY[name]
    if len(values) > limit:
        raise v.bad(f"at most {limit} {name} fit into a message, not {len(values)}")
    return "".join(f"<{element}>{_inside(value)}</{element}>" for value in values)


def _read(kind: type, element: Iterable[etree._Element]) -> Any:
    """A dataclass from the elements of what it holds."""
    told: dict[str, Any] = {name: [] for name in _MANY if name in _fields_of(kind)}
    for child in element:
        if name := next((n for n in told if n in _MANY and _MANY[n][0] == child.tag), None):
            told[name].append(_read(_MANY[name][1], child))
        else:
            told[_NAMES[child.tag]] = _FIELDS[_NAMES[child.tag]].read(child)
    return kind(**{n: tuple(x) if n in _MANY else x for n, x in told.items()})


def _fields_of(kind: Any) -> set[str]:
    return {field.name for field in fields(kind)}


def _writer(element: str, around: str = "") -> Callable[[Any], str]:
    before, after = (f"<{around}>", f"</{around}>") if around else ("", "")
    return lambda said: f"{before}<{element}>{_inside(said)}</{element}>{after}"


def _reader(kind: type) -> Read:
    return lambda element: _read(kind, element)


_KINDS: Final[tuple[type, ...]] = ControlRoomBody.__args__
_CONTENTS: Final[tuple[type, ...]] = (m.EventList, m.EventStatus, m.Proposal, m.DispatchStatus)

WRITERS: Final = {kind: _writer(kind.__name__, "Dispatch") for kind in _KINDS}
CONTENT_WRITERS: Final = {kind: _writer(kind.__name__) for kind in _CONTENTS}
READERS: Final = {kind.__name__: _reader(kind) for kind in _KINDS}
CONTENT_READERS: Final = {kind.__name__: _reader(kind) for kind in _CONTENTS}
