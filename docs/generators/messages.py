"""The page of messages: every kind, field and value of the XML schema, with its version."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from typing import Any

from lxml import etree

from dva_sim.protocol.limits import schema_file
from generators.markdown import ROOT, code, prose, table
from generators.markdown import page as page_of

USES = ROOT / "protocol/messages.csv"
"""Sender, receiver, meaning and manner of sending of each message, and who is obeyed."""

Node = Any  # elements and comments; the stubs of lxml know elements alone
_XS = "{http://www.w3.org/2001/XMLSchema}"
_SINCE = re.compile(r"since (\d+\.\d+)")
_KINDS = ("EmergencyMsg", "HBMsg", "RegMsg", "SimpleMsg")
_PAYLOADS = (
    *("RobotStatus", "PersonStatus", "Mission", "TeleOp", "Sensor", "DevSub"),
    *("Access", "Event", "RobotHolder", "Dispatch", "RobotEmergency", "Reply"),
)
_UNMARKED = {
    **dict.fromkeys(("PersonStatus", "Access", "Event", "SensorInfo", "Permission"), "1.1"),
    **dict.fromkeys(("SensorValue", "GoTo", "CancelMission", "Waypoint", "Frequency"), "1.1"),
    **dict.fromkeys(("Tick", "SeenTick"), "1.1"),
    "GetGrant / Level": "1.6",
}
"""Versions of elements and types that the schema does not mark."""
_HEAD = """\
Generated from [`protocol/dva.xsd`](../../protocol/dva.xsd), version {version}. Elements stand in
the order of the tables. *Count* says how often an element may occur; *since* gives the first
version that has it, 1.0 where it is empty. [The protocol](protocol.md) says what messages
mean and when a receiver obeys them."""


def page() -> str:
    """Return the page in Markdown."""
    schema: Node = etree.parse(str(schema_file())).getroot()
    types = {each.get("name"): each for each in schema if each.tag == f"{_XS}complexType"}
    head = ["message", "from → to", "meaning", "sent as", "obeyed"]
    blocks = [_HEAD.format(version=schema.get("version")), "## Overview", table(head, _uses())]
    for title, names in (
        ("Kinds of messages", _KINDS),
        ("Payloads of `SimpleMsg`", _PAYLOADS),
        ("Parts", [name for name in types if name not in (*_KINDS, *_PAYLOADS, "Empty")]),
    ):
        blocks.append(f"## {title}")
        for name in names:
            blocks += _section(name, types[name], schema)
    blocks += ["## Values", table(["type", "form", "since"], _values(schema))]
    return page_of("Messages", *blocks)


def _uses() -> Iterator[list[str]]:
    """Yield a row of the overview for each message; directions are paired in their order."""
    with USES.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            pairs = zip(row["from"].split("; "), row["to"].split("; "), strict=True)
            directions = "; ".join(f"{sender} → {receiver}" for sender, receiver in pairs)
            texts = (prose(row[name]) for name in ("meaning", "sent as", "obeyed"))
            yield [code(row["message"]), directions, *texts]


def names() -> set[str]:
    """Return the names of all elements that the schema declares."""
    schema: Node = etree.parse(str(schema_file())).getroot()
    return {each.get("name") for each in schema.iter(f"{_XS}element") if each.get("name")}


def _section(name: str, node: Node, schema: Node) -> Iterator[str]:
    yield f"### {name}"
    if since := _since(node):
        yield f"Since version {since}."
    yield table(["element", "type", "count", "since"], _rows(node, schema))


def _rows(node: Node, schema: Node, above: str = "", known: str = "") -> Iterator[list[str]]:
    """Yield a row for each element, those of an unnamed type below their parent.

    Args:
        node: Type, group or element that holds them.
        schema: The whole schema, for groups that are referred to.
        above: Path of the parent.
        known: Version of the parent; empty for the first one.
    """
    for each in node:
        if each.tag == f"{_XS}element":
            name = f"{above}{each.get('name')}"
            since = max(known, _since(each), _UNMARKED.get(name, ""))
            yield [code(name), _link(each.get("type")), _count(each), since]
            yield from _rows(each, schema, f"{name} / ", since)
        elif each.tag == f"{_XS}group" and each.get("ref"):
            group = schema.find(f"{_XS}group[@name='{each.get('ref')}']")
            yield from _rows(group, schema, above, known)
        elif isinstance(each.tag, str):
            yield from _rows(each, schema, above, known)


def _link(type_: str | None) -> str:
    if type_ in (None, "Empty"):
        return ""
    return code(type_.removeprefix("xs:"))


def _count(element: Node) -> str:
    least, most = element.get("minOccurs", "1"), element.get("maxOccurs", "1")
    return least if least == most else f"{least} to {most}"


def _since(node: Node) -> str:
    """Return the version in the comment right above an element or a type."""
    before = node.getprevious()
    while before is not None and before.tag is etree.Comment:
        if found := _SINCE.search(before.text or ""):
            return found[1]
        before = before.getprevious()
    return _UNMARKED.get(node.get("name"), "")


def _values(schema: Node) -> Iterator[list[str]]:
    for each in schema.iter(f"{_XS}simpleType"):
        if each.get("name"):
            yield [code(each.get("name")), "; ".join(_facets(each)), _since(each)]


def _word(value: Node) -> str:
    since = _since(value)
    return code(value.get("value")) + (f" (since {since})" if since else "")


def _facets(node: Node) -> Iterator[str]:
    restriction = node.find(f"{_XS}restriction")
    if restriction is None:
        return
    yield code(restriction.get("base").removeprefix("xs:"))
    if words := [_word(each) for each in restriction.findall(f"{_XS}enumeration")]:
        yield "one of " + ", ".join(words)
    for facet, word in (
        *(("minInclusive", "at least"), ("maxInclusive", "at most")),
        *(("minLength", "at least {} characters"), ("maxLength", "at most {} characters")),
        ("pattern", "pattern"),
    ):
        found = restriction.find(f"{_XS}{facet}")
        if found is not None:
            value = found.get("value")
            yield word.format(value) if "{}" in word else f"{word} {code(value)}"
    comment = node.getprevious()
    if comment is not None and comment.tag is etree.Comment:
        text = re.sub(r"since \d+\.\d+;?", "", comment.text or "").strip()
        if text and "\n" not in text and text != "Values":
            yield prose(text)
