"""Messages to bytes and back, by `protocol/dva.xsd`.

What `encode` returns is valid by construction. `decode` trusts nobody: libxml2 validates every
message while parsing it, and what a schema cannot forbid is refused before. Only messages in the
very form `encode` gives them, of the kinds that a drive is made of, take a shorter way.
"""

from __future__ import annotations

import re
from functools import cache, lru_cache
from pathlib import Path
from typing import Final

from lxml import etree

from dva_sim.protocol.canonical import read_canonical
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.messages import BAD_MESSAGE, Message
from dva_sim.protocol.readers import read
from dva_sim.protocol.writers import DECLARATION, write
from dva_sim.resources import roots

MAX_BYTES: Final = 8192
"""No message is longer."""

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


def timestamp(seconds_of_day: float, exact: bool = False) -> str:
    """Time of day as `HH:MM:SS`; midnight wraps.

    Args:
        seconds_of_day: [s]
        exact: To the microsecond; otherwise fractions are dropped.
    """
    whole = int(seconds_of_day // 1)
    told = _clock_face(whole % 86_400)
    return f"{told}.{int((seconds_of_day - whole) * 1e6):06}" if exact else told


@lru_cache(maxsize=64)
def _clock_face(second: int) -> str:
    minutes, seconds = divmod(second, 60)
    return f"{minutes // 60:02}:{minutes % 60:02}:{seconds:02}"


def encode(message: Message) -> bytes:
    """The message as UTF-8 XML, valid by the schema.

    Raises:
        ProtocolError: a value that the schema cannot hold (nan, an unknown mode, a bad id, ...),
            or a message of more than `MAX_BYTES`.
    """
    data = write(message).encode()
    if len(data) > MAX_BYTES:
        raise ProtocolError(BAD_MESSAGE, f"{len(data)} bytes; a message has at most {MAX_BYTES}")
    return data


def decode(data: bytes) -> Message:
    """The message in `data`; whatever the bytes, a message or a `ProtocolError`.

    Raises:
        ProtocolError: not a message by the specification; the reason fits into a reply.
    """
    return read_canonical(data) or _read_validated(data)


def _read_validated(data: bytes) -> Message:
    """The message in any form that the specification allows."""
    _refuse_by_sight(data)
    try:
        # libxml2 never forgets a run of blanks that it saw between elements.
        root = etree.fromstring(_BLANK_LINES.sub(b">\n<", data), _parser())
    except etree.XMLSyntaxError as error:
        raise ProtocolError(BAD_MESSAGE, _one_line(error)) from None
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
    found = _TAG.findall(rest)
    if len(found) != rest.count(b"<"):
        raise ProtocolError(
            BAD_MESSAGE, "markup other than plain elements, which have no attribute or namespace"
        )
    if not _names().issuperset(found):
        unknown = next(name for name in found if name not in _names())
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
    """All names of elements in the schema."""
    elements = etree.parse(_schema_path()).iter("{http://www.w3.org/2001/XMLSchema}element")
    return frozenset(element.get("name", "").encode() for element in elements)


@cache
def _parser() -> etree.XMLParser:
    """The one parser, with the schema attached; lxml locks it for each document."""
    # An encoding given here wins over what the document says, which has been checked by sight.
    return etree.XMLParser(
        schema=etree.XMLSchema(file=str(_schema_path())),
        encoding="UTF-8",
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )


def _schema_path() -> Path:
    """The schema that came with the program: one in the working folder must not replace it."""
    program = roots()[1:]
    return next(p for root in program if (p := root / "protocol" / "dva.xsd").is_file())


def _one_line(error: etree.XMLSyntaxError) -> str:
    """What libxml2 says, as text that fits into a reply."""
    # lxml spells some messages as the repr of their bytes.
    said = re.sub(r"""^line \d+: b(["'])(.*)\1$""", r"not well-formed: \2", str(error.msg))
    return "".join(c if c.isprintable() else " " for c in said)[:200]
