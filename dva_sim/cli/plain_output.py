"""Output for terminals and pipes that cannot encode every sign, with plain ones instead."""

from __future__ import annotations

import codecs
import io
import sys
import unicodedata
from typing import Final

HANDLER: Final = "dva-sim-plain"
_PLAIN: Final = {
    "–": "-",
    "—": "-",
    "−": "-",
    "…": "...",
    "×": "x",
    "·": "*",
    "≤": "<=",
    "≥": ">=",
    "±": "+-",
    "→": "->",
    "“": '"',
    "”": '"',
    "‘": "'",
    "’": "'",
}


def replace_what_cannot_be_shown() -> None:
    """Let standard output and errors write a plain sign where their encoding lacks one."""
    codecs.register_error(HANDLER, _plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and not stream.encoding.lower().startswith("utf"):
            stream.reconfigure(errors=HANDLER)


def _plain(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    signs = error.object[error.start : error.end]
    return "".join(map(_plain_sign, signs)), error.end


def _plain_sign(sign: str) -> str:
    if sign in _PLAIN:
        return _PLAIN[sign]
    if "─" <= sign <= "╿":  # lines of boxes
        return "-" if sign in "─━═" else "|" if sign in "│┃║" else "+"
    return unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode() or "?"
