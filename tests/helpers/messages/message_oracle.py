"""Independent reading of messages by the specification: tree, rules, schema, values."""

import math
import re
from dataclasses import fields, is_dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Any, get_args

from helpers.paths import ROOT
from lxml import etree

from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.errors import ProtocolError

SCHEMA = etree.XMLSchema(file=str(ROOT / "protocol" / "dva.xsd"))
PLAIN = re.compile(r"[A-Za-z]\w*", re.ASCII)
XML_SPACE = " \t\r\n"

# What is not the name of the class or field with capitals.
ELEMENTS = {
    m.Emergency: "EmergencyMsg",
    m.Heartbeat: "HBMsg",
    m.Registration: "RegMsg",
    m.Reply: "reply",
}
NAMES = {
    "actor": "ActorID",
    "address": "IpAddr",
    "advised": "AdvisedID",
    "author": "AuthorID",
    "candidates": "Candidate",
    "destination": "DestinationID",
    "device": "DeviceID",
    "devices": "Device",
    "dva": "DvaID",
    "event": "EventStatus",
    "event_id": "EventID",
    "events": "EventStatus",
    "fact": "FactNumber",
    "holder": "HolderID",
    "label": "DeviceLabel",
    "message_id": "MessageID",
    "mission_id": "MissionID",
    "name": "SensorName",
    "operator": "OperatorID",
    "origin": "OriginID",
    "region": "RegionName",
    "regions": "ServedRegion",
    "requests": "LoggedRequest",
    "responder": "ResponderID",
    "sensor": "SensorName",
    "source": "SourceID",
    "stopped_by": "StoppedByID",
    "values": "Value",
    "waypoints": "Waypoint",
}


def element_of(kind: type) -> str:
    return ELEMENTS.get(kind, kind.__name__)


BODY_ELEMENTS = {element_of(kind) for kind in get_args(m.Body)}


def judged(data: bytes) -> etree._Element | None:
    """The tree of a message that fulfils all four rules of the specification; else None."""
    # A zero byte is UTF-8, but a parser takes it for a sign of UTF-16.
    if len(data) > 8192 or data.startswith(b"\xef\xbb\xbf") or b"\0" in data:
        return None
    parser = etree.XMLParser(resolve_entities=False, strip_cdata=False, no_network=True)
    try:
        data.decode("utf-8")
        root = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, UnicodeDecodeError):
        return None
    if not _plain(root) or b"<![CDATA[" in etree.tostring(root, encoding="UTF-8"):
        return None
    return root if SCHEMA.validate(root) else None


def _plain(root: etree._Element) -> bool:
    """Return True for elements and text in UTF-8 only."""
    document = root.getroottree().docinfo
    if document.doctype or document.xml_version != "1.0":
        return False
    if (document.encoding or "UTF-8").upper() != "UTF-8":
        return False
    if [*root.itersiblings(), *root.itersiblings(preceding=True)]:
        return False
    # Comments, processing instructions and entities have a function for a tag.
    return all(
        isinstance(node.tag, str)
        and PLAIN.fullmatch(node.tag)
        and not node.attrib
        # An undeclared prefix is in the tag, a declared one in the map.
        and not node.nsmap
        for node in root.iter()
    )


def says(root: etree._Element, message: m.Message) -> bool:
    """True if the tree holds exactly the message's names and values, in order."""
    kind, body = root[0], message.body
    header = [(name, getattr(message, name)) for name in ("destination", "message_id", "source")]
    header = [(NAMES[name], value) for name, value in header]
    header.append(("Timestamp", message.timestamp))
    if message.session is not None:
        header.append(("SessionID", message.session))
    rest = list(kind)[len(header) :]
    tag = element_of(type(body))
    if kind.tag != "SimpleMsg":
        return kind.tag == tag and _all_say(list(kind), header + _children(body))
    if len(rest) != 1:
        return False
    payload = rest[0] if rest[0].tag in BODY_ELEMENTS else rest[0][0]
    return _all_say(list(kind)[: len(header)], header) and _all_say([payload], [(tag, body)])


def _all_say(elements: list[etree._Element], expected: list[tuple[str, Any]]) -> bool:
    return [element.tag for element in elements] == [tag for tag, _ in expected] and all(
        _one_says(element, value) for element, (_, value) in zip(elements, expected, strict=True)
    )


def _one_says(element: etree._Element, value: Any) -> bool:
    if isinstance(value, m.Order) and value.task == "confirm":
        # The usual task may be left out, and may be said.
        reports = [child for child in element if (child.tag, child.text) != ("Task", "confirm")]
        return _all_say(reports, _children(value)[:-1])
    if _has_parts(value):
        return _all_say(list(element), _children(value))
    return len(element) == 0 and same_value(element.text or "", value)


def _children(value: Any) -> list[tuple[str, Any]]:
    """Elements below, in order; what is None is absent."""
    found = []
    for name in _names(value):
        held = getattr(value, name)
        for one in held if isinstance(held, tuple) and not _has_parts(held) else [held]:
            if one is not None:
                found.append((_tag(name, one), one))
    return found


def _has_parts(value: Any) -> bool:
    return is_dataclass(value) or hasattr(value, "_fields")


def _names(value: Any) -> tuple[str, ...]:
    """Field names of a message or of a part."""
    return tuple(f.name for f in fields(value)) if is_dataclass(value) else value._fields


def _tag(name: str, value: Any) -> str:
    if name == "content":
        return type(value).__name__
    if name == "sensors":
        return "Sensor" if is_dataclass(value) else "SensorName"
    return NAMES.get(name) or "".join(part.capitalize() for part in name.split("_"))


def same_value(text: str, value: str | int | float) -> bool:
    """True if the text is this value, by exact arithmetic; signs of zeros count."""
    if isinstance(value, str):
        return text == value
    text = text.strip(XML_SPACE)
    exact = Fraction(Decimal(text))
    if isinstance(value, int):
        return exact == value
    return float(exact) == value and math.copysign(1, value) == (-1 if text[0] == "-" else 1)


def decode_or_refuse(data: bytes) -> m.Message | None:
    """Decode, or return None; fails where the specification disagrees."""
    tree = judged(data)
    try:
        decoded = decode(data)
    except ProtocolError as error:
        answer = m.Reply(0, error.code, error.reason)
        sent = m.Message("00:" * 5 + "00", 1, "00:" * 5 + "00", "00:00:00", 0, answer)
        assert decode(encode(sent)) == sent, "the reason fits into a reply"
        assert tree is None, data
        return None
    assert tree is not None, data
    assert says(tree, decoded), data
    return decoded
