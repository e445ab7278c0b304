"""Samples of the resources of a process, and their growth per hour, with an interval."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

BLOCKS = 12  # number of blocks, each with its median, as neighbouring samples are alike
T_975 = 2.228  # Student's t of 10 degrees of freedom, two blocks being used up by the line
MB = 1e6


class Taken(NamedTuple):
    """Amounts of a process: resident memory [MB], open files, threads."""

    memory: float
    files: float
    threads: float


class Slope(NamedTuple):
    """Growth in an hour, with its 95 % interval."""

    hourly: float
    low: float
    high: float


def taken_by(pid: int) -> Taken:
    """Return the resources of a process now.

    Raises:
        OSError: it has ended.
    """
    own = Path("/proc") / str(pid)
    pages = int((own / "statm").read_text().split()[1])
    files, threads = (sum(1 for _ in (own / name).iterdir()) for name in ("fd", "task"))
    memory = pages * os.sysconf("SC_PAGE_SIZE") / MB
    return Taken(memory, files, threads)


def slope(hours: Sequence[float], values: Sequence[float]) -> Slope:
    """Return the growth of what was sampled at some times [h]: a line through block medians."""
    at = np.asarray(hours)
    edges = np.linspace(at[0], at[-1], BLOCKS + 1)
    block = np.clip(np.searchsorted(edges, at, "right") - 1, 0, BLOCKS - 1)
    if len(np.unique(block)) < BLOCKS:
        return Slope(math.nan, -math.inf, math.inf)
    middles = 0.5 * (edges[1:] + edges[:-1])
    medians = [float(np.median(np.asarray(values)[block == n])) for n in range(BLOCKS)]
    hourly, start = np.polyfit(middles, medians, 1)
    rest = np.asarray(medians) - start - hourly * middles
    spread = float(((middles - middles.mean()) ** 2).sum())
    error = math.sqrt(float((rest**2).sum()) / (BLOCKS - 2) / spread)
    return Slope(float(hourly), float(hourly - T_975 * error), float(hourly + T_975 * error))
