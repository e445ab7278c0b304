"""The shipped plug-ins in words, so that `dva-sim list` need not load them."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Final

FILE: Final = Path(__file__).with_suffix(".json")


@cache
def shipped_words() -> dict[str, dict[str, str]]:
    """Read the first paragraphs of docstrings, by kind and name."""
    words: dict[str, dict[str, str]] = json.loads(FILE.read_text(encoding="utf-8"))
    return words
