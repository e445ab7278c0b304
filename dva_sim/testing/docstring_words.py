"""Words for shipped plug-ins from their docstrings.

    python -m dva_sim.testing.docstring_words

writes `shipped_words.json`.
"""

from __future__ import annotations

import json

from dva_sim.testing.promises import TRIALS
from dva_sim.testing.shipped_words import FILE


def from_docstrings() -> dict[str, dict[str, str]]:
    """Load the shipped plug-ins; return the correct contents of the file, by kind and name."""
    return {name: dict(sorted(kind.docstrings().items())) for name, kind in TRIALS.items()}


if __name__ == "__main__":
    FILE.write_text(json.dumps(from_docstrings(), indent=1, ensure_ascii=False) + "\n", "utf-8")
