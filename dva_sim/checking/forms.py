"""What the value of an element should look like, in words, read from the schema itself."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Final

from lxml import etree

from dva_sim.resources import roots

_XS: Final = "{http://www.w3.org/2001/XMLSchema}"
_WHOLE: Final = {"xs:unsignedInt": str(2**32 - 1), "xs:unsignedLong": str(2**64 - 1)}


def schema_file() -> Path:
    """The schema of the program; one in the working folder does not judge messages."""
    found = (root / "protocol" / "dva.xsd" for root in roots()[1:])
    return next(path for path in found if path.is_file())


@cache
def form_of(element: str) -> str | None:
    """What an element should hold; None if it holds elements, or different things by place."""
    tree = etree.parse(schema_file())
    types = {e.get("type") for e in tree.iter(f"{_XS}element") if e.get("name") == element}
    if len(types) != 1:
        return None
    facets = _facets(tree, str(types.pop()))
    return _in_words(facets) if facets else None


def _facets(tree: etree._ElementTree, name: str) -> dict[str, list[str]]:
    """All that restricts a simple type, the narrowest first, and `base`, what it starts from."""
    facets: dict[str, list[str]] = {}
    while (restriction := _restriction(tree, name)) is not None:
        for facet in restriction.iterchildren(f"{_XS}*"):
            facets.setdefault(etree.QName(facet).localname, []).append(str(facet.get("value")))
        name = str(restriction.get("base"))
        facets["base"] = [name]
    return facets


def _restriction(tree: etree._ElementTree, name: str) -> etree._Element | None:
    for simple in tree.getroot().iterchildren(f"{_XS}simpleType"):
        if simple.get("name") == name:
            return simple.find(f"{_XS}restriction")
    return None


def _in_words(facets: dict[str, list[str]]) -> str:
    if "enumeration" in facets:
        *others, last = facets["enumeration"]
        return f"one of {', '.join(others)} or {last}" if others else last
    base = facets["base"][0]
    if base in _WHOLE or "minInclusive" in facets:
        low = facets.get("minInclusive", ["0"])[0]
        high = facets.get("maxInclusive", [_WHOLE.get(base, "any")])[0]
        kind = "a whole number" if base in _WHOLE else "a number"
        return f"{kind} from {low} to {high}, in the digits 0 to 9"
    if "maxLength" in facets:
        shortest, longest = facets.get("minLength", ["0"])[0], facets["maxLength"][0]
        length = f"{shortest} to {longest} characters"
        return f"{length} of the form {facets['pattern'][0]}" if "pattern" in facets else length
    return "of the form " + " and ".join(facets["pattern"])
