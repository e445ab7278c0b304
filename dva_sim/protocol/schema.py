"""Validation of bytes by `protocol/dva.xsd` before they are used.

libxml2 validates every message while parsing it. What a schema cannot forbid is refused before
that: other encodings, other markup, entities, unknown names.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Final

from lxml import etree

from dva_sim.protocol import limits
from dva_sim.protocol.elements import DECLARATION, read
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.messages import BAD_MESSAGE, Message

MAX_BYTES: Final = 8192  # longest message [B]

_OUR_DECLARATION = DECLARATION.encode()
_DECLARATION = re.compile(
    rb"""<\?xml\s+version\s*=\s*(["'])1\.0\1"""
    rb"""(?:\s+encoding\s*=\s*(["'])utf-8\2)?"""
    rb"""(?:\s+standalone\s*=\s*(["'])(?:yes|no)\3)?\s*\?>""",
    re.IGNORECASE,
)
# Every `<` has to begin `<name>`, `</name>` or `<name/>`.
_TAG = re.compile(rb"</?(\w++)\s*+/?>")
_OTHER_ENTITY = re.compile(rb"&(?!(?:amp|lt|gt|quot|apos|#[0-9]++|#x[0-9A-Fa-f]++);)")
# No string may hold a line break or tab, so between `>` and `<` one blank is as good as any.
_BLANK_LINES = re.compile(rb"> *+[\t\r\n][ \t\r\n]*+<")


def read_validated(data: bytes) -> Message:
    """Return the message in any form that the specification allows."""
    _refuse_by_sight(data)
    try:
        # libxml2 keeps each run of blanks that it has seen between elements, for good.
        root = etree.fromstring(_BLANK_LINES.sub(b">\n<", data), _parser())
    except etree.XMLSyntaxError as error:
        # lxml spells some messages as the repr of their bytes.
        problem = re.sub(r"""^line \d+: b(["'])(.*)\1$""", r"not well-formed: \2", str(error.msg))
        text = "".join(c if c.isprintable() else " " for c in problem)[:200]
        raise ProtocolError(BAD_MESSAGE, text) from None
    return read(root)


def _refuse_by_sight(data: bytes) -> None:
    """Refuse what the parser must not see: size, encodings, other markup, unknown names.

    The markup matters: a DOCTYPE brings entities, `xsi:schemaLocation` makes libxml2 open files,
    a comment inside a value hides half of it from careless readers, and a schema does not see
    prefixes that were never declared. The names matter, also of entities, because libxml2 keeps
    each one that it has read for as long as the thread lives: new ones would fill the memory.
    """
    if len(data) > MAX_BYTES:
        raise ProtocolError(BAD_MESSAGE, f"{len(data)} bytes; a message has at most {MAX_BYTES}")
    rest = data[_end_of_declaration(data) :]
    if 0 in rest or not rest.lstrip().startswith(b"<"):
        raise ProtocolError(BAD_MESSAGE, "not XML in UTF-8 without byte order mark")
    tags = _TAG.findall(rest)
    if len(tags) != rest.count(b"<"):
        raise ProtocolError(
            BAD_MESSAGE, "markup other than plain elements, which have no attribute or namespace"
        )
    if not _names().issuperset(tags):
        unknown = next(name for name in tags if name not in _names())
        raise ProtocolError(BAD_MESSAGE, f"no element is called {unknown.decode()[:64]}")
    if _OTHER_ENTITY.search(rest):
        raise ProtocolError(BAD_MESSAGE, "& that begins no &amp;, &lt;, &gt; or the like")


def _end_of_declaration(data: bytes) -> int:
    if data.startswith(_OUR_DECLARATION):
        return len(_OUR_DECLARATION)
    if not data.startswith(b"<?xml"):
        return 0
    declaration = _DECLARATION.match(data)
    if declaration is None:
        raise ProtocolError(
            BAD_MESSAGE, "the XML declaration is broken, or names another encoding than UTF-8"
        )
    return declaration.end()


@cache
def _names() -> frozenset[bytes]:
    """Return all names of elements in the schema."""
    return frozenset(name.encode() for name in limits.names())


@cache
def _parser() -> etree.XMLParser:
    """Return the one parser, with the schema attached; lxml locks it for each document."""
    # An encoding given here wins over what the document says, which has been checked by sight.
    return etree.XMLParser(
        schema=etree.XMLSchema(file=str(limits.schema_file())),
        encoding="UTF-8",
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
