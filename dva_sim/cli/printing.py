"""What other programs read: JSON on standard output, and nothing else there."""

from __future__ import annotations

import math
from typing import Any

import typer


def print_json(data: Any) -> None:
    """Print as JSON; what is no number is null."""
    import json

    typer.echo(json.dumps(_plain(data), indent=2, ensure_ascii=False, allow_nan=False))


def _plain(value: Any) -> Any:
    """As JSON can hold it: what is missing or infinite is null, and arrays are lists."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if hasattr(value, "tolist"):  # of numpy
        return _plain(value.tolist())
    return value
