"""What `-v` tells beside what is told as usual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dva_sim.experiments.results.data_dictionary import describe
from dva_sim.experiments.results.results import plain
from dva_sim.experiments.study.cell_grid import REFERENCE, Cell
from dva_sim.experiments.study.labels import brief
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.verbosity import detail, is_verbose

WRITTEN = ("*.html", "*.pdf", "*.json", "figures/*", "tables/*")
"""Files of a results folder."""


def tell_measures(row: Mapping[str, Any], model: str) -> None:
    """Every measure of a run, with its unit and what it means."""
    if not is_verbose():
        return
    detail("")
    width = max(map(len, row), default=0)
    for column in describe("runs", list(row), [model], []):
        value = f"{plain(row[column.name])} {column.unit}".strip()
        detail(f"{column.name:<{width}}  {value:<14}  {column.meaning}".rstrip())


def tell_cells(study: Study, cells: Sequence[Cell]) -> None:
    """The study's file, and every configuration."""
    if not is_verbose():
        return
    detail(f"Study: {study.file}, seed {study.seed}")
    for cell in cells:
        which = "reference" if cell.index == REFERENCE else f"cell {cell.index}"
        detail(f"  {cell.part}, {which}: {brief(dict(cell.levels)) or '-'} ({cell.config})")


def tell_files(folder: Path, *patterns: str) -> None:
    """Files that were written, with their size."""
    if not is_verbose():
        return
    for path in sorted(path for pattern in patterns for path in folder.glob(pattern)):
        detail(f"  {path}: {path.stat().st_size:,} bytes")
