"""Labels that people can tell apart: without invisible characters, and no two look the same."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from typing import Final

LONGEST: Final = 64  # maximum characters of a label in a message
# Letters and marks that are drawn as nothing or as a gap, although `isprintable` accepts them:
# Unicode's Default_Ignorable_Code_Point beyond the format characters, and the empty Braille cell.
_BLANK: Final = frozenset(
    [
        *map(chr, (0x034F, 0x115F, 0x1160, 0x17B4, 0x17B5, 0x2800, 0x3164, 0xFFA0)),
        *map(chr, range(0x180B, 0x1810)),
        *map(chr, range(0xFE00, 0xFE10)),
        *map(chr, range(0xE0100, 0xE01F0)),
    ]
)


HIDDEN = {
    code: chr(code).encode("unicode_escape").decode()
    for code in (
        *range(9),
        11,
        12,
        *range(14, 32),
        127,
        *range(0x202A, 0x202F),
        *range(0x2066, 0x206A),
    )
}
"""Escapes of the characters that control a terminal or turn the direction of text, for pages."""


def visible(text: str) -> str:
    r"""Return the text with an escape, such as `\u202e`, for each invisible character.

    Characters that change the direction of text or end a line count as invisible.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        c if c.isprintable() and c not in _BLANK else c.encode("unicode_escape").decode()
        for c in text
    )


def look_of(label: str) -> str:
    """Normalise a label: without regard to case, width and white space."""
    return " ".join(unicodedata.normalize("NFKC", visible(label)).casefold().split())


def with_id(label: str, id_tag: str) -> str:
    """Return a unique label, made with the device's id and cut to the limit of messages."""
    beside = f" ({id_tag})"
    visible_label = visible(label).strip()[: LONGEST - len(beside)]
    return f"{visible_label}{beside}" if visible_label else id_tag


def distinct(label: str, id_tag: str, others: Iterable[str]) -> str:
    """Return a label for display, with the device's id if another label looks the same.

    Args:
        label: Label as given by a device.
        id_tag: Id of the device.
        others: Labels of other devices.
    """
    look = look_of(label)
    if not look or any(look_of(other) == look for other in others):
        return with_id(label, id_tag)
    return visible(label)[:LONGEST]
