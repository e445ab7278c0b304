"""Limits of `protocol/dva.xsd` as data: every limit and every name on the wire.

Writer, reader and checker all derive their checks from it.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final

from lxml import etree

from dva_sim.kernel.resources import roots

_XS: Final = "{http://www.w3.org/2001/XMLSchema}"
WHOLE: Final = {"xs:unsignedInt": 2**32 - 1, "xs:unsignedLong": 2**64 - 1}
"""Base types of whole numbers, and the largest number of each."""

# The schema's \P{Cc}, no control characters, without those that XML cannot hold.
_CHARACTER: Final = "[^\x00-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]"


def schema_file() -> Path:
    """Return the schema that came with the program.

    One in the working folder must not replace it.
    """
    files = (root / "protocol" / "dva.xsd" for root in roots()[1:])
    return next(path for path in files if path.is_file())


@cache
def tree() -> etree._ElementTree:
    """Return the schema, read once."""
    return etree.parse(schema_file())


@cache
def facets(name: str) -> dict[str, list[str]]:
    """Return the restrictions of a simple type, narrowest first, and `base`, its base type."""
    limits: dict[str, list[str]] = {}
    while (restriction := _restrictions().get(name)) is not None:
        for facet in restriction.iterchildren(f"{_XS}*"):
            limits.setdefault(etree.QName(facet).localname, []).append(str(facet.get("value")))
        name = str(restriction.get("base"))
        limits["base"] = [name]
    return limits


@cache
def _restrictions() -> dict[str, etree._Element]:
    types = tree().getroot().iterchildren(f"{_XS}simpleType")
    return {str(t.get("name")): r for t in types if (r := t.find(f"{_XS}restriction")) is not None}


def types_of(element: str) -> set[str | None]:
    """Return the types of all elements of a name."""
    return {e.get("type") for e in tree().iter(f"{_XS}element") if e.get("name") == element}


def names() -> frozenset[str]:
    """Return all names of elements."""
    return frozenset(e.get("name", "") for e in tree().iter(f"{_XS}element"))


def choices(name: str) -> list[str]:
    """Return the words that a type allows."""
    return facets(name)["enumeration"]


def pattern(name: str) -> str:
    """Return the form of a type's text as a regular expression without length and groups."""
    form = facets(name)["pattern"][0]
    return form.replace("(", "(?:").replace(r"\P{Cc}", _CHARACTER)


def length(name: str) -> tuple[int, int]:
    """Return the least and the greatest length of a type's text [characters]."""
    limits = facets(name)
    return int(limits.get("minLength", ["0"])[0]), int(limits["maxLength"][0])


def bounds(name: str) -> tuple[float, float]:
    """Return the least and the greatest of a type's numbers; of whole numbers they are whole."""
    limits = facets(name)
    kind = int if facets(name)["base"][0] in WHOLE else float
    low = limits.get("minInclusive", ["0"])[0]
    high = limits.get("maxInclusive")
    return kind(low), kind(high[0]) if high else WHOLE[limits["base"][0]]


def children(element: etree._Element) -> list[etree._Element]:
    """Return the elements that an element may hold, in order, with all of a choice."""
    return list(_below(element))


def parts(name: str) -> list[etree._Element]:
    """Return the elements of a named type or group; see `children`."""
    return list(_below(_named()[name]))


def _below(node: etree._Element) -> Iterator[etree._Element]:
    type_name = node.get("type") or node.get("ref")
    for child in node if type_name is None else [_named()[type_name]]:
        if child.tag == f"{_XS}element":
            yield child
        elif isinstance(child.tag, str):
            yield from _below(child)


@cache
def _named() -> dict[str, etree._Element]:
    """Return types that hold elements, and groups."""
    nodes = tree().getroot().iterchildren(f"{_XS}complexType", f"{_XS}group")
    return {str(node.get("name")): node for node in nodes}


def is_simple(element: etree._Element) -> bool:
    """Return True if an element holds a value rather than elements."""
    return element.get("type") in _restrictions()


def occurs(element: etree._Element) -> tuple[int, int]:
    """Return how often an element may occur at its place: at least and at most."""
    return int(element.get("minOccurs", "1")), int(element.get("maxOccurs", "1"))
