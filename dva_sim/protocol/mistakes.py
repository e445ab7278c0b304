"""Diagnosis of invalid messages: what is wrong, and where; only refused messages are searched.

The correct form of a value is described in words, derived from the schema itself.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any, Final
from xml.parsers import expat

from lxml import etree

from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.limits import WHOLE, facets, schema_file, types_of
from dva_sim.protocol.schema import MAX_BYTES


@cache
def form_of(element: str) -> str | None:
    """Return what an element should hold; None if it holds elements, or varies by place."""
    types = types_of(element)
    if len(types) != 1:
        return None
    limits = facets(str(types.pop()))
    return _in_words(limits) if limits else None


def _in_words(limits_of_type: dict[str, list[str]]) -> str:
    if "enumeration" in limits_of_type:
        *values, last = limits_of_type["enumeration"]
        return f"one of {', '.join(values)} or {last}" if values else last
    base = limits_of_type["base"][0]
    if base in WHOLE or "minInclusive" in limits_of_type:
        low = limits_of_type.get("minInclusive", ["0"])[0]
        high = limits_of_type.get("maxInclusive", [WHOLE.get(base, "any")])[0]
        kind = "a whole number" if base in WHOLE else "a number"
        return f"{kind} from {low} to {high}, in the digits 0 to 9"
    if "maxLength" in limits_of_type:
        shortest = limits_of_type.get("minLength", ["0"])[0]
        longest = limits_of_type["maxLength"][0]
        length = f"{shortest} to {longest} characters"
        return (
            f"{length} of the form {limits_of_type['pattern'][0]}"
            if "pattern" in limits_of_type
            else length
        )
    return "of the form " + " and ".join(limits_of_type["pattern"])


READ_BYTES: Final = MAX_BYTES + 1
"""Bytes to read of a file: enough to know that a message is too long."""
_SHOWN: Final = 60  # maximum characters shown of a wrong value

_PIECES: Final = (
    (rb"<\?xml", "should begin <?xml"),
    (rb"""\s+version\s*=\s*(["'])1\.0\1""", 'should go on with version="1.0"'),
    (rb"""(?:\s+encoding\s*=\s*(["'])(?i:utf-8)\1)?""", ""),
    (rb"""(?:\s+standalone\s*=\s*(["'])(?:yes|no)\1)?""", ""),
    (rb"\s*\?>", 'should be <?xml version="1.0" encoding="UTF-8"?>, or left out'),
)
_ALLOWED: Final = re.compile(rb"</?\w+\s*/?>")
_MARKUP: Final = (
    (rb"<!--", "a comment is not allowed; leave it out"),
    (rb"<!\[CDATA\[", "a CDATA section is not allowed; write &lt; and &amp; in plain text"),
    (rb"(?i)<!DOCTYPE", "a DOCTYPE is not allowed; leave it out"),
    (rb"<\?", "a processing instruction is not allowed; leave it out"),
    (rb"</?[^\s<>&/=!?]*:", "a prefix is not allowed; names stand without a namespace"),
    (rb"<[^\s<>&/=!?]+\s+[^\s<>=]+\s*=", "an attribute is not allowed; leave it out"),
    (rb"</?[^\s<>&/=!?]+\s*/?>", "a name of other signs is not allowed; all are A to Z and a to z"),
)


@dataclass
class _Place:
    """Offsets of an element, and of the first text directly inside it [bytes]."""

    start: int
    text: int | None = None


def check_message(data: bytes) -> list[Problem]:
    """Return all that is wrong with a message, in the order of the file; empty if it is valid."""
    try:
        decode(data)
    except ProtocolError as error:
        problems = _by_sight(data) or _by_grammar(data) or _by_schema(data)
        return sorted(set(problems)) or [Problem(1, 1, f"{error.reason}; see protocol/README.md")]
    return []


def _by_sight(data: bytes) -> list[Problem]:
    """Find what no schema can express: size, encoding, declaration, markup; the first only."""
    if not data.strip():
        return [Problem(1, 1, "is empty; should hold one <msg>")]
    if len(data) > MAX_BYTES:
        return [at(data, MAX_BYTES, f"is too long; a message has at most {MAX_BYTES} bytes")]
    if data.startswith((b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")):
        return [Problem(1, 1, "begins with a byte order mark; should be UTF-8 without one")]
    broken, end = _declaration(data)
    problem = broken or not_text(data) or _before_the_root(data, end)
    return [problem] if problem else list(_other_markup(data, end))


def _declaration(data: bytes) -> tuple[Problem | None, int]:
    """Return the problem of the declaration, if any, and where the declaration ends."""
    end = 0
    if not data.startswith(b"<?xml"):
        return None, end
    for piece, right in _PIECES:
        match = re.compile(piece).match(data, end)
        if match is None:
            while data[end : end + 1].isspace():
                end += 1
            return at(data, end, f"the XML declaration is broken; it {right}"), end
        end = match.end()
    return None, end


def _before_the_root(data: bytes, start: int) -> Problem | None:
    rest = data[start:].lstrip()
    if rest.startswith(b"<"):
        return None
    return at(data, len(data) - len(rest), "no element begins here; should be <msg>")


def _other_markup(data: bytes, start: int) -> Iterator[Problem]:
    for mark in re.finditer(rb"<", data[start:]):
        offset = start + mark.start()
        if _ALLOWED.match(data, offset):
            continue
        texts = (text for form, text in _MARKUP if re.compile(form).match(data, offset))
        text = next(texts, None)
        if text is not None:  # otherwise it is not markup, and the parser explains it better
            yield at(data, offset, text)


def _by_grammar(data: bytes) -> list[Problem]:
    """Find where the text stops being XML: libxml2's reason, at expat's more exact position."""
    parser = _plain_parser()
    try:
        etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        problem = parser.error_log[0].message if len(parser.error_log) else str(error.msg)
        text = f"is not well-formed XML: {problem}"
        _, stop = _walk(data)
        return [Problem(*error.position, text) if stop is None else at(data, stop, text)]
    return []


def _by_schema(data: bytes) -> list[Problem]:
    """Return every element that the schema refuses, each with the first reason."""
    tree = etree.ElementTree(etree.fromstring(data, _plain_parser()))
    schema = _schema()
    schema.validate(tree)
    places = dict(zip(tree.iter("*"), _walk(data)[0], strict=True))
    problems: dict[int, Problem] = {}
    log: Any = schema.error_log  # iterable, although lxml's stubs do not say so
    for entry in list(log):
        element = _element_at(tree, entry.path)
        place = places[element]
        stray = place.text if "haracter content" in entry.message else None
        offset = place.start if stray is None else stray
        problems.setdefault(offset, at(data, offset, _explain(element, entry)))
    return list(problems.values())


def _element_at(tree: etree._ElementTree, path: str | None) -> etree._Element:
    elements: Any = tree.xpath(path) if path else None
    element: etree._Element = elements[0] if elements else tree.getroot()
    return element


def _explain(element: etree._Element, entry: Any) -> str:
    """Translate a finding of libxml2, and say what would be right."""
    name = str(element.tag)
    kind = entry.type_name
    _, _, expected = entry.message.rstrip(". ").partition(" Expected is ")
    right = expected.removeprefix("one of").strip("() ").replace(", ", " or ")
    if kind == "SCHEMAV_CVC_ELT_1":
        return f"{name} is not a message; the root should be msg"
    if "Missing child" in entry.message:
        return f"{name} is not complete; should continue with {right}"
    if kind == "SCHEMAV_ELEMENT_CONTENT":
        return f"{name} does not belong here; should be " + (
            right or "the end of what is around it"
        )
    if kind.startswith("SCHEMAV_CVC_COMPLEX_TYPE"):
        what = "text" if "haracter content" in entry.message else "an element"
        return f"{what} should not stand in {name}; leave it out"
    form = form_of(name) or "as protocol/dva.xsd says"
    value = element.text or ""
    short = repr(value if len(value) <= _SHOWN else value[:_SHOWN] + "...")
    return f"{name} {short} is not valid; should be {form}"


def _walk(data: bytes) -> tuple[list[_Place], int | None]:
    """Return the place of every element in file order, and the byte where it had to end."""
    parser = expat.ParserCreate("UTF-8")
    parser.buffer_text = False  # otherwise text is reported at the next element's position
    places: list[_Place] = []
    inside: list[_Place] = []

    def start(_name: str, _attributes: object) -> None:
        places.append(_Place(parser.CurrentByteIndex))
        inside.append(places[-1])

    def text(characters: str) -> None:
        blank = len(characters) - len(characters.lstrip(" \t\r\n"))
        if blank < len(characters) and inside[-1].text is None:
            inside[-1].text = parser.CurrentByteIndex + blank

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _name: inside.pop()
    parser.CharacterDataHandler = text
    try:
        parser.Parse(data, True)
    except expat.ExpatError:
        return places, parser.ErrorByteIndex
    return places, None


@cache
def _schema() -> etree.XMLSchema:
    return etree.XMLSchema(file=str(schema_file()))


def _plain_parser() -> etree.XMLParser:
    """Return a parser without the schema, as safe as the codec's; a new one has an empty log."""
    return etree.XMLParser(
        encoding="UTF-8", resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False
    )


@dataclass(frozen=True, order=True)
class Problem:
    """Mistake in a file.

    Attributes:
        line: Line in the file, from 1.
        column: Column in that line, from 1, in characters.
        text: Mistake, and the correct form.
        file: The file that holds it, if not the one that was checked.
    """

    line: int
    column: int
    text: str
    file: str | None = None


def at(data: bytes, offset: int, text: str) -> Problem:
    """Return the mistake at a byte of a text in UTF-8, with any line endings."""
    before = data[:offset].decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n")
    line_start = before.rfind("\n") + 1
    return Problem(before.count("\n") + 1, len(before) - line_start + 1, text)


def not_text(data: bytes) -> Problem | None:
    """Return the first byte that text in UTF-8 cannot have, if there is one."""
    zero = data.find(0)
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        if zero < 0 or error.start < zero:
            mistake = f"byte 0x{data[error.start]:02X} is not text in UTF-8"
            return at(data, error.start, f"{mistake}; the file should be in UTF-8")
    return (
        at(data, zero, "a zero byte is not text; the file should be in UTF-8")
        if zero >= 0
        else None
    )
