"""Recorded links in files of one column: packet opportunities, or bare delays."""

from __future__ import annotations

import math
import re
import statistics
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel import resources
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.read_once import read_once

Floats = NDArray[np.float64]
_MAX_DURATION_S = 60.0
_RATE = re.compile(r'"bits_per_second"\s*:\s*([\d.eE+-]+)')
_ROUND_TRIP = re.compile(r'"rtt"\s*:\s*(\d+)')


@read_once(lambda path: [file_of(path)])
def read_trace(path: str) -> Floats:
    """Return the packet opportunities [s], shape `(n,)`, of a Mahimahi trace.

    Raises:
        ConfigError: not readable, not whole milliseconds, not ascending, or too short.
    """
    times: list[int] = []
    for number, text in numbered_lines(path, "trace"):
        if not text.isdigit():
            raise ConfigError(f"should be a whole millisecond, not {text[:20]!r}", path, number, 1)
        if times and int(text) < times[-1]:
            raise ConfigError(f"{text} ms comes after {times[-1]} ms", path, number, 1)
        times.append(int(text))
    if not times or times[-1] <= 0:
        raise ConfigError("contains no packet opportunity after 0 ms", path)
    return np.array(times, dtype=np.float64) / 1000.0


def is_trace(path: str) -> bool:
    """Return True if a file of one column holds ascending whole milliseconds, as a trace does."""
    texts = [text for _, text in numbered_lines(path, "recorded link")]
    times = [int(text) for text in texts if text.isdigit()]
    return len(times) == len(texts) > 0 and times == sorted(times)


def longest_gap_s(times: Floats) -> float:
    """Return for how long a trace carries nothing at most, over and over [s]."""
    return float(np.max(np.diff(times, prepend=0.0)))


@read_once(lambda path: [file_of(path)])
def read_delays(path: str) -> tuple[float, ...]:
    """Return delays [s] of a file with one a line [ms].

    Raises:
        ConfigError: not readable, not a delay, or none.
    """
    lines = numbered_lines(path, "file of delays")
    delays = tuple(parse_delay(text, path, number) for number, text in lines if text[0] != "#")
    if not delays:
        raise ConfigError("contains no delay", path)
    return delays


def parse_delay(text: str, path: str, line: int, unit: str = "ms", scale: float = 1e-3) -> float:
    """Return a delay [s] from a number in some unit of `scale` seconds."""
    delay = parse_number(text, f"a delay [{unit}]", path, line) * scale
    if not 0 <= delay <= _MAX_DURATION_S:
        problem = (
            f"a delay should be between 0 and {_MAX_DURATION_S / scale:g} {unit}, not {text[:20]}"
        )
        raise ConfigError(problem, path, line, 1)
    return delay


def parse_number(text: str, what: str, path: str, line: int) -> float:
    """Return a finite number; `what` names it in the error."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ConfigError(f"should be {what}, not {text[:20]!r}", path, line, 1)
    return value


def file_of(path: str) -> Path:
    """Return a file by its path, or one that is shipped by its name."""
    shipped = (root / "experiments/traces" / path for root in resources.roots())
    return next((file for file in (Path(path), *shipped) if resources.is_file(file)), Path(path))


def _of_trips(content: str) -> str:
    """Return the key that the round trips in a report of iperf3 [us] can give; empty: it has none.

    They are of a link under load, so a log of delays is not made of them.
    """
    trips = [float(text) for text in _ROUND_TRIP.findall(content) if float(text) > 0]
    if not trips:
        return ""
    half_s = statistics.median(trips) / 2e6
    usual = f"{half_s * 2000:.3g} ms in the median"
    return f"; for its round trips under load, {usual}, set link.delay_s={half_s:.3g}"


def numbered_lines(path: str, what: str) -> Iterator[tuple[int, str]]:
    """Yield the number and text of each line that is not empty.

    Raises:
        ConfigError: not readable, or a report of iperf3, which holds throughput.
    """
    try:
        content = file_of(path).read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:  # such as text that is none, or a name that is none
        reason = error.strerror if isinstance(error, OSError) else "is not text"
        raise ConfigError(f"{what} cannot be read: {reason}", path) from error
    if content.lstrip().startswith("{") and (rates := _RATE.findall(content)):
        rate = f"throughput of at most {max(map(float, rates)):,.0f} bit/s"
        problem = f"is a report of iperf3, {rate}, not a {what}; for a rate set link.rate_bps"
        raise ConfigError(problem + _of_trips(content), path, 1, 1)
    for number, line in enumerate(content.split("\n"), start=1):
        text = line.strip()
        if text:
            yield number, text
