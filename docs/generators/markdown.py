"""Markdown of generated pages: tables, code, and text that cannot be taken for markup."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_CODE = re.compile(r"(`[^`]*`)")


def prose(text: str) -> str:
    """Return a text on one line, with `<`, `*` and `$` outside code escaped."""
    parts = _CODE.split(" ".join(text.split()))
    parts[::2] = [re.sub(r"([<*$\[\]])", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


def paragraphs(text: str) -> str:
    """Return a text of several paragraphs as prose."""
    return "\n\n".join(prose(part) for part in text.strip().split("\n\n"))


def code(text: object) -> str:
    """Return a text as inline code; nothing for an empty one."""
    return f"`{text}`" if str(text) else ""


def sentence(text: str) -> str:
    """Return a text as prose with a capital, and a full stop if it ends without a mark."""
    text = prose(text)
    stop = "" if text.endswith((".", "?", "!")) else "."
    return f"{text[:1].upper()}{text[1:]}{stop}" if text else ""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; a pipe within a cell is escaped."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(
        "| " + " | ".join(re.sub(r"(?<!\\)\|", r"\|", cell) for cell in line) + " |"
        for line in lines
    )


def shell(lines: Iterable[str]) -> str:
    """Return a block of shell commands."""
    return "\n".join(["```console", *(f"$ {line}" for line in lines), "```"])


def page(title: str, *blocks: str) -> str:
    """Return a page of a title and blocks, empty blocks left out."""
    return "\n\n".join([f"# {title}", *(block for block in blocks if block)]) + "\n"
