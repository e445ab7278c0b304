"""Delay logs: probes of a link in columns, or as `ping -D` prints them."""

from __future__ import annotations

import math
import re
from typing import Final, NamedTuple

import numpy as np

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.read_once import read_once
from dva_sim.kernel.suggestions import listed
from dva_sim.network.link.recorded import Floats, file_of, numbered_lines, parse_delay, parse_number

UNITS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_LOST: Final = frozenset({"-", "*", "lost", "nan"})
_REPLY: Final = re.compile(
    r"\[(\d+\.?\d*)\] \d+ bytes from .*\bicmp_seq=(\d+) .*\btime=(\d+\.?\d*) ms"
)
_NO_REPLY: Final = re.compile(r"\[\d+\.?\d*\] .*\bicmp_seq=(\d+)\b")
_BEGIN: Final = "PING "  # the first line of each run of ping
_SUMMARY_STARTS: Final = ("--- ", "rtt ")  # lines of its summary
_SUMMARY: Final = re.compile(r"\d+ packets transmitted")
_NUMBERS: Final = 65536  # ping counts its requests with 16 bits
_SAME_S: Final = 0.01  # tolerance of the sending time among replies to one request [s]

_UNIT_OF: Final = re.compile(r"(?:[a-z_ ]*[\s_\[(])?(s|ms|us|µs|ns)[\])]?", re.IGNORECASE)
_TIMES: Final = re.compile(r"time|elapsed|sent|epoch|date|\bt\b", re.IGNORECASE)
_DELAYS: Final = re.compile(r"rtt|delay|latency|owd|round", re.IGNORECASE)
_RATES: Final = re.compile(r"bps|bit|byte|throughput|bandwidth|\brate", re.IGNORECASE)
_EPOCH: Final = (1e9, 1e10)  # plausible range of today's time in seconds: years 2001 to 2286
_SPARSE_S: Final = 5.0  # longer steps between probes are questioned [s]
_SPARSEST_S: Final = 60.0  # longer steps mean a smaller unit [s]
_USUAL_S: Final = (0.010, 2.0)  # median delays that are plausible without a unit [s]
_TOO_SHORT: Final = "needs probes of at least two moments"
WRITE: Final = "write a first line such as time_s,delay_ms"


class DelayLog(NamedTuple):
    """Probes of a link.

    Attributes:
        times: Send times of the probes [s], ascending, shape `(n,)`.
        delays: Measured delays [s]; not a number for lost probes, shape `(n,)`.
        runs: Number of runs of ping, each played right after the one before.
        units: Units of the file's times and delays.
        assumed: `times`, `delays`: those whose unit the file does not name.
        doubts: Sentences on what is probably a mistake, without full stop.
    """

    times: Floats
    delays: Floats
    runs: int = 1
    units: tuple[str, str] = ("s", "ms")
    assumed: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


class _Columns(NamedTuple):
    """Places and units of times and delays; None where the file names no unit."""

    width: int = 2
    time: int = 0
    delay: int = 1
    time_unit: str | None = None
    delay_unit: str | None = None


@read_once(lambda path: [file_of(path)])
def read_delay_log(path: str) -> DelayLog:
    """Read a log of probes: columns of times and delays, or what `ping -D` prints.

    A first line, or comment, names columns and units. Without it there are two: times in the unit
    that their size or spacing tells, else [s], and delays in [ms]. In columns `-`, `*`, `lost` or
    `nan` stands for a lost probe. In what ping prints, a request is lost that no reply has the
    number of; when it was sent follows from its neighbours.

    Raises:
        ConfigError: not readable, a line that is neither, times that go back, fewer than two
            probes, or all of them lost.
    """
    lines = list(numbered_lines(path, "delay log"))
    raw = any(text.startswith(_BEGIN) or "icmp_seq=" in text for _, text in lines[:10])
    log = _ping_output(path, lines) if raw else _in_columns(path, lines)
    if len(log.times) < 2 or log.times[-1] <= log.times[0]:
        raise ConfigError(_TOO_SHORT, path)
    if np.isnan(log.delays).all():
        raise ConfigError("contains only lost probes", path)
    return log


def is_delay_log(path: str) -> bool:
    """Return True if the first line, comments skipped, has several columns."""
    lines = (text for _, text in numbered_lines(path, "recorded link") if text[0] != "#")
    return len(_words(next(lines, ""))) > 1


def _words(text: str) -> list[str]:
    """Return the columns of a line, separated by commas, semicolons or tabs, or else by spaces."""
    separator = r"[,;\t]" if re.search(r"[,;\t]", text) else r"\s+(?![\[(])"
    return [word.strip().strip('"') for word in re.split(separator, text)]


# --- columns ---------------------------------------------------------------------------
def _in_columns(path: str, lines: list[tuple[int, str]]) -> DelayLog:
    columns = _columns_of(path, lines)
    rows = [(number, _words(text)) for number, text in lines if text[0] != "#"]
    if rows and _is_head(rows[0][1]):
        rows = rows[1:]
    delay_unit = columns.delay_unit or "ms"
    times = list[float]()
    delays = list[float]()
    for number, words in rows:
        if len(words) != columns.width:
            problem = f"should be a time and a delay, not {' '.join(words)[:40]!r}"
            raise ConfigError(problem, path, number, 1)
        time = parse_number(words[columns.time], "a time", path, number)
        if times and time < times[-1]:
            raise ConfigError(f"time {time:.16g} comes after {times[-1]:.16g}", path, number, 1)
        times.append(time)
        text = words[columns.delay]
        lost = text.lower() in _LOST
        delays.append(
            math.nan if lost else parse_delay(text, path, number, delay_unit, UNITS[delay_unit])
        )
    if len(set(times)) < 2:
        raise ConfigError(_TOO_SHORT, path)
    time_unit = columns.time_unit or _unit_of_times(times)
    named = {"times": columns.time_unit, "delays": columns.delay_unit}
    log = DelayLog(
        np.array(times) * UNITS[time_unit],
        np.array(delays),
        units=(time_unit, delay_unit),
        assumed=tuple(what for what, unit in named.items() if unit is None),
    )
    return log._replace(doubts=tuple(_doubts(log, columns)))


def _columns_of(path: str, lines: list[tuple[int, str]]) -> _Columns:
    """Find the columns by a first line of names, or by a comment that holds two units."""
    for number, text in lines:
        if text[0] == "#":
            units = [_unit_of(name) for name in _words(text.lstrip("# "))]
            if len(units) == 2 and all(units):
                return _Columns(time_unit=units[0], delay_unit=units[1])
            continue
        names = _words(text)
        if _is_head(names):
            return _named(names, path, number)
        break
    return _Columns()


def _named(names: list[str], path: str, number: int) -> _Columns:
    delay = next((n for n, name in enumerate(names) if _DELAYS.search(name)), None)
    if delay is None and any(_RATES.search(name) for name in names):
        problem = f"is a log of throughput, not of delays: it has {listed(names)}"
        raise ConfigError(f"{problem}; for a rate set link.rate_bps", path, number, 1)
    time = next((n for n, name in enumerate(names) if n != delay and _TIMES.search(name)), None)
    if len(names) == 2 and all(map(_unit_of, names)):
        delay = 1 if delay is None else delay
        time = 1 - delay
    if time is None or delay is None:
        problem = f"needs a column of times and one of delays; it has {listed(names)}"
        raise ConfigError(f"{problem}: {WRITE}", path, number, 1)
    return _Columns(len(names), time, delay, _unit_of(names[time]), _unit_of(names[delay]))


def _unit_of(name: str) -> str | None:
    match = _UNIT_OF.fullmatch(name)
    return match[1].lower() if match else None


def _is_head(words: list[str]) -> bool:
    return len(words) > 1 and not any(map(_is_number, words))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _unit_of_times(times: list[float]) -> str:
    """Return the unit in which the first time is of today, or the probes are close together."""
    step = _step(np.array(times))
    for unit in ("s", "ms", "us", "ns"):
        if _EPOCH[0] <= times[0] * UNITS[unit] < _EPOCH[1]:
            return unit
    return next((unit for unit in ("s", "ms", "us") if step * UNITS[unit] <= _SPARSEST_S), "ns")


def _step(times: Floats) -> float:
    steps = np.diff(times)
    return float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0


def _doubts(log: DelayLog, columns: _Columns) -> list[str]:
    doubts = list[str]()
    time_unit, delay_unit = log.units
    if columns.time_unit is None and (step := _step(log.times)) > _SPARSE_S:
        doubts.append(
            f"its times are taken for {time_unit}, {step:g} s between probes; if they are in "
            f"another unit, {WRITE}"
        )
    lasting = log.delays[~np.isnan(log.delays)]
    usual = float(np.median(lasting)) if len(lasting) else _USUAL_S[0]
    if columns.delay_unit is None and not _USUAL_S[0] <= usual <= _USUAL_S[1]:
        doubts.append(
            f"its delays are taken for {delay_unit}, {usual * 1000:.3g} ms in the median; if they "
            f"are in another unit, {WRITE}; if they are throughput, set link.rate_bps instead"
        )
    return doubts


# --- output of ping --------------------------------------------------------------------
class _Run:
    """Replies of one run of ping by number, each with its send time and delay [s]."""

    def __init__(self) -> None:
        self.replies: dict[int, tuple[float, float]] = {}
        self.last = 0
        self.newest = 0

    def count(self, number: int) -> int:
        """Return the running number of a request whose last 16 bits are known."""
        self.last = self._unwrapped(number)
        self.newest = max(self.newest, self.last)
        return self.last

    def is_over(self, number: int, sent: float) -> bool:
        """Return True if this reply is of another run: its number starts again, or jumps far."""
        if not self.replies:
            return False
        full = self._unwrapped(number)
        top = max(self.replies)
        if full > top:
            return number < self.last % _NUMBERS and full - self.newest > _NUMBERS // 4
        same, _ = self.replies.get(full, (sent, 0.0))
        return abs(sent - same) > _SAME_S or sent > self.replies[top][0] + _SAME_S

    def _unwrapped(self, number: int) -> int:
        if not self.last:
            return number
        half = _NUMBERS // 2
        return self.last + (number - self.last + half) % _NUMBERS - half

    def log(self) -> DelayLog:
        """Return all requests from the first that was replied to, in order."""
        answered = np.array(sorted(self.replies))
        sent = np.maximum.accumulate([self.replies[n][0] for n in answered])
        numbers = np.arange(answered[0], self.newest + 1)
        step = (sent[-1] - sent[0]) / max(1, answered[-1] - answered[0])
        times = np.interp(numbers, answered, sent) + step * np.maximum(0, numbers - answered[-1])
        delays = np.full(len(numbers), math.nan)
        delays[answered - answered[0]] = [self.replies[n][1] for n in answered]
        return DelayLog(times, delays)


def _ping_output(path: str, lines: list[tuple[int, str]]) -> DelayLog:
    """Requests by number; a second reply to the same request is left out."""
    runs = [_Run()]
    for line, text in lines:
        if text.startswith(_SUMMARY_STARTS) or _SUMMARY.match(text):
            continue
        if text.startswith(_BEGIN):
            runs.append(_Run())
            continue
        reply = _REPLY.match(text)
        missing = _NO_REPLY.match(text)
        if reply is not None:
            delay = parse_delay(reply[3], path, line)
            sent = float(reply[1]) - delay
            if runs[-1].is_over(int(reply[2]), sent):
                runs.append(_Run())
            runs[-1].replies.setdefault(runs[-1].count(int(reply[2])), (sent, delay))
        elif missing is not None:
            runs[-1].count(int(missing[1]))
        else:
            problem = f"should be a reply as printed by ping -D, not {text[:40]!r}"
            raise ConfigError(problem, path, line, 1)
    logs = [run.log() for run in runs if run.replies]
    if not logs:
        raise ConfigError("contains no reply", path)
    return _joined(logs)


def _joined(logs: list[DelayLog]) -> DelayLog:
    """Play each run a usual step after the one before; the pause between them was not probed."""
    step = float(np.median([_step(log.times) for log in logs]))
    times = [logs[0].times]
    for log in logs[1:]:
        times.append(log.times - log.times[0] + times[-1][-1] + step)
    return DelayLog(np.concatenate(times), np.concatenate([log.delays for log in logs]), len(logs))
