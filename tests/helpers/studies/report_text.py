"""What a reader sees of a report."""

from __future__ import annotations

import html
import re
from pathlib import Path

_INLINE = r"</?(?:a|b|dfn|span)\b[^>]*>"


def words(report: Path) -> str:
    """The page without styles and pictures; what is folded away is there too."""
    page = re.sub(r"<style>.*?</style>", "", report.read_text(encoding="utf-8"), flags=re.S)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", re.sub(_INLINE, "", page))).split())
