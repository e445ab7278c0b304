"""Logs of an accelerometer as common logger apps export them: time and three axes, with a head.

Separators, decimal commas and the order of columns are detected; units by the header, by
what is asked for, or by gravity. A log without gravity, or of gravity alone, is refused.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean, median, pstdev
from typing import Final, Literal, NamedTuple

from dva_sim.agents.tilt.accelerometer import GRAVITY
from dva_sim.kernel.csv_cells import numbered_rows
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import listed
from dva_sim.kernel.yaml_files import read_text
from dva_sim.recordings.motion import MAX_DURATION_S, STRONGEST_MPS2, MotionSample

Unit = Literal["m/s2", "g"]

NEEDED: Final = "needs columns for the time and for the axes x, y and z (acceleration with gravity)"
_TIMES: Final = re.compile(r"seconds_elapsed|elapsed|time|timestamp|t", re.IGNORECASE)
_AXIS: Final = re.compile(r"(?:.*(?:acc\w*|gf|force)[\W_]*|a)?([xyz])(?:[\W_].*)?", re.IGNORECASE)
_WITHOUT_GRAVITY: Final = re.compile(r"lin(ear|[\W_]*acc)|without g|user", re.IGNORECASE)
_IN_MPS2: Final = re.compile(r"m\s*/\s*s|mps2|ms-2|m s-2", re.IGNORECASE)
_IN_G: Final = re.compile(r"\(g\)|\[g\]|_g\b|gf|g-force", re.IGNORECASE)
_TIME_UNITS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_STEPS: Final = 0.5e-3, 0.5  # range of steps between samples [s]: a factor of 1000 fits one unit
_AROUND_GRAVITY: Final = 0.15  # maximum deviation of the median from gravity, as a share
_AROUND_NAMED_GRAVITY: Final = 0.5  # the same where the unit is named
_STEADY_S: Final = 1.0  # time for which gravity roughly keeps its direction [s]
_STEADY_SHARE: Final = 0.6  # of gravity, left in the mean of so long: half a turn in it leaves 0.64
_TURNS: Final = 0.01  # difference along an axis that shows motion, as a share of gravity
_EVEN: Final = 1e-4  # relative deviation of the magnitude below that of any accelerometer
_INSTEAD: Final = "log acceleration with gravity (in Sensor Logger: TotalAcceleration)"


class SensorLog(NamedTuple):
    """Samples of a log, with times from zero, and the units that were guessed, with reasons."""

    samples: list[MotionSample]
    guesses: tuple[str, ...]


class _Columns(NamedTuple):
    """Columns of time and axes, and units given in the header."""

    time: int
    axes: tuple[int, int, int]
    names: Sequence[str]


def read_sensor_log(path: Path, unit: Unit | None = None) -> SensorLog:
    """Read the samples of a log.

    Args:
        path: The file.
        unit: Unit of the axes; None: from the header, or else from gravity.

    Raises:
        ConfigError: no such log: which columns it needs and has; a line that is damaged; or
            values that are not acceleration with gravity.
    """
    lines = read_text(path).split("\n")
    delimiter = max(";\t,", key=lambda sign: lines[0].count(sign))
    rows = [(number, row) for number, row in numbered_rows(lines, path, delimiter) if row]
    if not rows:
        raise ConfigError(f"is empty; a log of an accelerometer {NEEDED}", path)
    columns = _columns_of(rows[0][1], path)
    if not columns.names:
        rows.insert(0, (0, []))
    numbered = [(number, _numbers(row, columns, path, number)) for number, row in rows[1:]]
    times = [numbers[0] for _, numbers in numbered]
    axes = [numbers[1:] for _, numbers in numbered]
    guesses = list[str]()
    second = _find_second(times, columns, path, guesses)
    metre = _find_metre(axes, columns, unit, path, guesses)
    _require_gravity(axes, metre, (times[-1] - times[0]) * second if times else 0.0, path)
    samples = list[MotionSample]()
    for number, (time, x, y, z) in numbered:
        times_s = (time - times[0]) * second
        if samples and times_s < samples[-1].stamp:
            raise ConfigError("time goes backwards here", path, number, 1)
        xyz = (x * metre, y * metre, z * metre)
        if times_s > MAX_DURATION_S or max(map(abs, xyz)) > STRONGEST_MPS2:
            raise ConfigError("has a value that no phone's sensor has", path, number, 1)
        samples.append(MotionSample(times_s, math.nan, math.nan, xyz, 0))
    return SensorLog(samples, tuple(guesses))


def _columns_of(head: Sequence[str], path: Path) -> _Columns:
    """Find the columns; a file without a header has time, x, y, z."""
    names = [name.strip() for name in head]
    if all(_is_number(name) for name in names) and len(names) == 4:
        return _Columns(0, (1, 2, 3), ())
    plain = [re.sub(r"[\[(].*", "", name).strip() for name in names]
    times = [n for n, name in enumerate(plain) if _TIMES.fullmatch(re.sub(r"[\W_]*m?s$", "", name))]
    times += [n for n, name in enumerate(plain) if _TIMES.fullmatch(name) and n not in times]
    elapsed = [n for n in times if "elapsed" in plain[n].lower()]
    axes: dict[str, int] = {}
    for n, name in enumerate(names):
        match = _AXIS.fullmatch(name)
        if match and n not in times and not _WITHOUT_GRAVITY.search(name):
            axes.setdefault(match[1].lower(), n)
    if len(axes) < 3 and any(map(_WITHOUT_GRAVITY.search, names)):
        raise ConfigError(f"is acceleration without gravity: {_INSTEAD}", path, 1, 1)
    if not times or len(axes) < 3:
        raise ConfigError(f"is not a motion log: it {NEEDED}; it has: {listed(names)}", path, 1, 1)
    return _Columns((elapsed or times)[0], (axes["x"], axes["y"], axes["z"]), names)


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def _numbers(
    row: Sequence[str], columns: _Columns, path: Path, number: int
) -> tuple[float, float, float, float]:
    try:
        time, x, y, z = (
            float(row[n].strip().replace(",", ".")) for n in (columns.time, *columns.axes)
        )
    except (ValueError, IndexError):
        raise ConfigError(
            f"should be a time and x, y, z, not {row!r:.60}", path, number, 1
        ) from None
    if not all(map(math.isfinite, (time, x, y, z))):
        raise ConfigError("has a value that is not finite", path, number, 1)
    return time, x, y, z


def _find_second(
    times: Sequence[float], columns: _Columns, path: Path, guesses: list[str]
) -> float:
    """Return the seconds in one unit of time: by the header, else by the spacing of samples."""
    head = columns.names[columns.time] if columns.names else ""
    named = re.search(r"[\[(_ ]\s*(s|ms|us|µs|ns)\s*[\])]?$", head)
    if named:
        return _TIME_UNITS[named[1]]
    if head.lower().startswith("seconds"):
        return 1.0
    steps = [b - a for a, b in itertools.pairwise(times) if b > a]
    usual = median(steps) if steps else 0.0
    fitting = [s for s in (1.0, 1e-3, 1e-6, 1e-9) if _STEPS[0] <= usual * s < _STEPS[1]]
    if not fitting:
        text = f"its times are {usual:g} apart, in no unit a phone's: name it, as in time (ms)"
        raise ConfigError(text, path, 1, 1)
    name = next(name for name, second in _TIME_UNITS.items() if second == fitting[0])
    guesses.append(f"times in {name}, which are {usual:g} apart")
    return fitting[0]


def _find_metre(
    axes: Sequence[Sequence[float]],
    columns: _Columns,
    unit: Unit | None,
    path: Path,
    guesses: list[str],
) -> float:
    """Return the factor from the unit of the axes to m/s^2."""
    head = " ".join(columns.names[n] for n in columns.axes) if columns.names else ""
    if unit is None and _IN_MPS2.search(head):
        unit = "m/s2"
    if unit is None and _IN_G.search(head):
        unit = "g"
    usual = median(math.hypot(*xyz) for xyz in axes) if axes else 0.0
    units: dict[Unit, float] = {"m/s2": GRAVITY, "g": 1.0}
    around = _AROUND_GRAVITY if unit is None else _AROUND_NAMED_GRAVITY
    near = (u for u, metre in units.items() if abs(usual / metre - 1) < around)
    fitting = next((u for u in near if unit in (None, u)), None)
    if fitting is None:
        text = f"acceleration is {usual:.3g} in the median, gravity would be 9.81 m/s^2 or 1 g"
        hint = "or, if the phone was shaken, give --unit" if unit is None else f"not {unit}"
        raise ConfigError(f"{text}: {_INSTEAD}, {hint}", path)
    if unit is None:
        guesses.append(f"acceleration in {fitting}, whose magnitude is {usual:.3g} in the median")
    return GRAVITY if fitting == "g" else 1.0


def _require_gravity(
    axes: Sequence[Sequence[float]], metre: float, lasts_s: float, path: Path
) -> None:
    """Refuse a log whose direction is not steady, or whose magnitude is steadier than a sensor's.

    Raises:
        ConfigError: it is acceleration without gravity, or gravity alone.
    """
    window = max(1, round(len(axes) * _STEADY_S / max(lasts_s, _STEADY_S)))
    stretches = [axes[n : n + window] for n in range(0, len(axes) - window + 1, window)]
    means = [math.hypot(*map(fmean, zip(*stretch, strict=True))) for stretch in stretches]
    steady = median(means) * metre / GRAVITY
    if steady < _STEADY_SHARE:
        text = f"{steady:.2f} g is left of it in the mean of {_STEADY_S:g} s, of gravity 1 g"
        raise ConfigError(f"is acceleration without gravity, {text}: {_INSTEAD}", path)
    moves = max(max(axis) - min(axis) for axis in zip(*axes, strict=True)) * metre / GRAVITY
    if moves > _TURNS and pstdev(math.hypot(*xyz) for xyz in axes) * metre / GRAVITY < _EVEN:
        raise ConfigError(f"is gravity alone, as its magnitude never varies: {_INSTEAD}", path)
