"""What tells configurations, studies and files apart: hashes that are the same on every machine."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from dva_sim.config import Config

_LONGEST_NAME = 1000  # of a file that is looked for


def stable_hash(data: Any) -> str:
    """64 bits that depend on the data alone, not on the machine or the order of keys."""
    return digest(data)[:16]


def digest(data: Any) -> str:
    """All 256 bits of the same."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()


def inputs(scenarios: Iterable[Config]) -> dict[str, str]:
    """Files that scenarios name by path (maps, traces), with the hash of their contents."""
    dumps = (scenario.model_dump(mode="json") for scenario in scenarios)
    names = sorted({text for dump in dumps for text in _texts(dump) if "." in text})
    short = [name for name in names if "\n" not in name and len(name) < _LONGEST_NAME]
    paths = [(name, Path(_file_of(name))) for name in short]
    return {
        name: hashlib.sha256(path.read_bytes()).hexdigest()[:16]
        for name, path in paths
        if path.is_file()
    }


def _file_of(name: str) -> str:
    """The file of a class that is named as `file.py:Class`; other names are files as they are."""
    return name.rpartition(":")[0] if ".py:" in name else name


def _texts(data: Any) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, Mapping | list):
        for value in data.values() if isinstance(data, Mapping) else data:
            yield from _texts(value)
