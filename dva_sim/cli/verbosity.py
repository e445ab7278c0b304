"""Verbosity of a command: errors only, normal, or detailed; or JSON only."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dva_sim.experiments.study.cell_grid import DesignCell
    from dva_sim.experiments.study.study import Study
    from dva_sim.kernel.measure import Measure

_verbose: ContextVar[bool] = ContextVar("verbose", default=False)


@contextmanager
def loudness(quiet: bool = False, verbose: bool = False) -> Iterator[None]:
    """Set how much is printed inside the block."""
    token = _verbose.set(verbose and not quiet)
    try:
        if not quiet:
            yield
            return
        with Path(os.devnull).open("w", encoding="utf-8") as nowhere, redirect_stdout(nowhere):
            yield
    finally:
        _verbose.reset(token)


def is_verbose() -> bool:
    """Return True if detailed output is wanted."""
    return _verbose.get()


def detail(line: str) -> None:
    """Print a line if `--verbose` is set."""
    if is_verbose():
        print(line)


def print_json(data: Any) -> None:
    """Print as JSON; NaN becomes null."""
    print(json.dumps(_plain(data), indent=2, ensure_ascii=False, allow_nan=False))


def _plain(value: Any) -> Any:
    """Convert a value for JSON: missing and infinite become null, and arrays lists."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if hasattr(value, "tolist"):  # of numpy
        return _plain(value.tolist())
    return value


WRITTEN = ("*.html", "*.pdf", "*.json", "figures/*", "tables/*")
"""Files of a results folder."""


def tell_measures(row: Mapping[str, Any], columns: Iterable[Measure]) -> None:
    """Print every measure of a run, with its unit and meaning."""
    if is_verbose():
        print("", *lines_of(row, columns), sep="\n")


def lines_of(row: Mapping[str, Any], columns: Iterable[Measure]) -> Iterator[str]:
    """Yield each value of a row in a line, with its unit and meaning."""
    from dva_sim.experiments.results.results import plain  # late: start-up
    from dva_sim.kernel.measure import Measure  # late: start-up

    width = max(map(len, row), default=0)
    column_by_name = {column.name: column for column in columns}
    for name, cell in row.items():
        column = column_by_name.get(name) or Measure(name, "")
        value = f"{plain(cell)} {column.unit}".strip()
        yield f"{name:<{width}}  {value:<14}  {column.meaning}".rstrip()


def tell_cells(study: Study, cells: Sequence[DesignCell]) -> None:
    """Tell the study's file, and every configuration."""
    if not is_verbose():
        return
    from dva_sim.experiments.study.addresses import REFERENCE  # late: start-up
    from dva_sim.simulation.labels import brief  # late: start-up

    detail(f"Study: {study.file}, seed {study.seed}")
    for cell in cells:
        which = "reference" if cell.cell == REFERENCE else f"cell {cell.cell}"
        detail(f"  {cell.part}, {which}: {brief(cell.levels) or '-'} ({cell.config})")


def tell_files(folder: Path, *patterns: str) -> None:
    """Tell files that were written, with their size."""
    if not is_verbose():
        return
    for path in sorted(path for pattern in patterns for path in folder.glob(pattern)):
        detail(f"  {path}: {path.stat().st_size:,} bytes")
