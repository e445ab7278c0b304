"""Recorded links in files: packet opportunities, logs of delays, bare delays."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel import resources
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.read_once import read_once

Floats = NDArray[np.float64]
_LOST = frozenset({"-", "*", "lost", "nan"})
_REPLY = re.compile(r"\[(\d+\.?\d*)\] \d+ bytes from .*\bicmp_seq=(\d+) .*\btime=(\d+\.?\d*) ms")
_NO_REPLY = re.compile(r"\[\d+\.?\d*\] .*\bicmp_seq=(\d+)\b")
_AROUND = ("PING ", "--- ", "rtt ")  # what ping prints before and after its replies
_SUMMARY = re.compile(r"\d+ packets transmitted")
_NUMBERS = 65536  # ping counts its requests with 16 bits
_LONGEST_S = 60.0


class DelayLog(NamedTuple):
    """Probes of a link.

    Attributes:
        times: Send times of the probes [s], ascending, shape `(n,)`.
        delays: Measured delays [s]; not a number for lost probes, shape `(n,)`.
    """

    times: Floats
    delays: Floats


@read_once(lambda path: [_found(path)])
def read_trace(path: str) -> Floats:
    """Packet opportunities [s], shape `(n,)`, of a Mahimahi trace.

    Raises:
        ConfigError: not readable, not whole milliseconds, not ascending, or too short.
    """
    times: list[int] = []
    for number, text in _lines(path, "trace"):
        if not text.isdigit():
            raise ConfigError(f"should be a whole millisecond, not {text[:20]!r}", path, number, 1)
        if times and int(text) < times[-1]:
            raise ConfigError(f"{text} ms comes after {times[-1]} ms", path, number, 1)
        times.append(int(text))
    if not times or times[-1] <= 0:
        raise ConfigError("contains no packet opportunity after 0 ms", path)
    return np.array(times, dtype=np.float64) / 1000.0


def columns_of(path: str) -> int:
    """Count the words in the first line of a recorded link, comments skipped; 0 without any."""
    lines = (text for _, text in _lines(path, "recorded link") if text[0] != "#")
    return len(re.split(r"[\s,;]+", next(lines, "").strip()))


def is_trace(path: str) -> bool:
    """Return True if a file of one column holds ascending whole milliseconds, as a trace does."""
    texts = [text for _, text in _lines(path, "recorded link")]
    times = [int(text) for text in texts if text.isdigit()]
    return len(times) == len(texts) > 0 and times == sorted(times)


def longest_gap_s(times: Floats) -> float:
    """For how long a trace carries nothing at most, over and over [s]."""
    return float(np.max(np.diff(times, prepend=0.0)))


@read_once(lambda path: [_found(path)])
def read_delays(path: str) -> tuple[float, ...]:
    """Delays [s] of a file with one a line [ms].

    Raises:
        ConfigError: not readable, not a delay, or none.
    """
    lines = _lines(path, "file of delays")
    delays = tuple(_delay(text, path, number) for number, text in lines if text[0] != "#")
    if not delays:
        raise ConfigError("contains no delay", path)
    return delays


@read_once(lambda path: [_found(path)])
def read_delay_log(path: str) -> DelayLog:
    """A log of probes: two columns, time [s] and delay [ms], or what `ping -D` prints.

    In two columns `-`, `*`, `lost` or `nan` stands for a lost probe. In what ping prints, a
    request is lost that no reply has the number of; when it was sent follows from its
    neighbours.

    Raises:
        ConfigError: not readable, a line that is neither, times that go back, fewer than two
            probes, or all of them lost.
    """
    lines = list(_lines(path, "delay log"))
    raw = any(text.startswith("PING ") or "icmp_seq=" in text for _, text in lines[:10])
    log = _ping_output(path, lines) if raw else _two_columns(path, lines)
    if len(log.times) < 2 or log.times[-1] <= log.times[0]:
        raise ConfigError("needs probes of at least two moments", path)
    if np.isnan(log.delays).all():
        raise ConfigError("contains only lost probes", path)
    return log


def _two_columns(path: str, lines: list[tuple[int, str]]) -> DelayLog:
    times: list[float] = []
    delays: list[float] = []
    for number, text in lines:
        if text[0] == "#":
            continue
        columns = text.replace(",", " ").replace(";", " ").split()
        if len(columns) != 2:
            problem = f"should be a time [s] and a delay [ms], not {text[:40]!r}"
            raise ConfigError(problem, path, number, 1)
        time = _number(columns[0], "a time [s]", path, number)
        if times and time < times[-1]:
            raise ConfigError(f"{time:.16g} s comes after {times[-1]:.16g} s", path, number, 1)
        times.append(time)
        lost = columns[1].lower() in _LOST
        delays.append(math.nan if lost else _delay(columns[1], path, number))
    return DelayLog(np.array(times), np.array(delays))


def _ping_output(path: str, lines: list[tuple[int, str]]) -> DelayLog:
    """Requests by number; a second reply to the same request is left out."""
    replies: dict[int, tuple[float, float]] = {}
    newest = last = 0
    for number, text in lines:
        if text.startswith(_AROUND) or _SUMMARY.match(text):
            continue
        reply, other = _REPLY.match(text), _NO_REPLY.match(text)
        if reply is None and other is None:
            problem = f"should be a reply as printed by ping -D, not {text[:40]!r}"
            raise ConfigError(problem, path, number, 1)
        last = _unwrapped(int(reply[2] if reply else other[1]), last)  # type: ignore[index]
        newest = max(newest, last)
        if reply:
            delay = _delay(reply[3], path, number)
            replies.setdefault(last, (float(reply[1]) - delay, delay))
    if not replies:
        raise ConfigError("contains no reply", path)
    return _with_lost(replies, newest)


def _unwrapped(number: int, last: int) -> int:
    """The running number of a request whose last 16 bits are known, near the `last` one."""
    return last + (number - last + _NUMBERS // 2) % _NUMBERS - _NUMBERS // 2 if last else number


def _with_lost(replies: dict[int, tuple[float, float]], newest: int) -> DelayLog:
    """All requests from the first that was replied to, in order."""
    known = np.array(sorted(replies))
    sent = np.maximum.accumulate([replies[n][0] for n in known])
    numbers = np.arange(known[0], newest + 1)
    step = (sent[-1] - sent[0]) / max(1, known[-1] - known[0])
    times = np.interp(numbers, known, sent) + step * np.maximum(0, numbers - known[-1])
    delays = np.full(len(numbers), math.nan)
    delays[known - known[0]] = [replies[n][1] for n in known]
    return DelayLog(times, delays)


def _delay(text: str, path: str, number: int) -> float:
    """A delay [s] from milliseconds."""
    delay = _number(text, "a delay [ms]", path, number) / 1000.0
    if not 0 <= delay <= _LONGEST_S:
        problem = f"a delay should be between 0 and {_LONGEST_S * 1000:g} ms, not {text[:20]}"
        raise ConfigError(problem, path, number, 1)
    return delay


def _number(text: str, what: str, path: str, line: int) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ConfigError(f"should be {what}, not {text[:20]!r}", path, line, 1)
    return value


def _found(path: str) -> Path:
    """A file by its path, or one that is shipped by its name."""
    shipped = (root / "experiments/traces" / path for root in resources.roots())
    return next((file for file in (Path(path), *shipped) if resources.is_file(file)), Path(path))


def _lines(path: str, what: str) -> Iterator[tuple[int, str]]:
    """Number and text of each line that is not empty."""
    try:
        lines = _found(path).read_text(encoding="utf-8-sig").split("\n")
    except (OSError, ValueError) as error:  # such as text that is none, or a name that is none
        reason = error.strerror if isinstance(error, OSError) else "is not text"
        raise ConfigError(f"{what} cannot be read: {reason}", path) from error
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if text:
            yield number, text
