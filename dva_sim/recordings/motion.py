"""Files of a phone's motion: what its part measured while a person drove, to be replayed.

A file is text that spreadsheets read: lines of numbers, and between them lines that begin with `#`:
what the numbers are, and each app that took the samples from then on. Who held the phone, and where
it is from, is not in it; its times begin at zero.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

from dva_sim.agents.tilt import PhoneProfile
from dva_sim.agents.tilt.accelerometer import Triple
from dva_sim.agents.tilt.app import TiltCommand
from dva_sim.agents.tilt.device_axes import ORIENTATIONS, to_tilt_axes
from dva_sim.agents.tilt.measured import MeasuredTilt
from dva_sim.kernel.config import validate
from dva_sim.kernel.errors import ConfigError

FIRST_LINE: Final = "# dva-sim phone motion 1"
UNITS: Final = (
    "# t_s: by the phone's clock; came_s, at_s: by the run's, when it came and was taken [s]",
    "# x, y, z: acceleration with gravity, in the phone's own axes [m/s^2]",
)
COLUMNS: Final = "t_s,came_s,at_s,x_mps2,y_mps2,z_mps2,orientation_deg"
APP: Final = "# app "
MAX_DURATION_S: Final = 1e6  # maximum duration of a run: ten days
STRONGEST_MPS2: Final = 1e5  # maximum acceleration along an axis: ten times what breaks a phone
MAX_BYTES: Final = 64_000_000  # maximum size of a file: about two hours at 60 samples a second


class NoMotionOfOursError(ConfigError):
    """A file that was not written by a console."""


class MotionSample(NamedTuple):
    """One sample.

    Attributes:
        stamp: By the phone's clock, from the first one on [s].
        came: By the run's clock [s].
        at: Time of the sample, by the same clock [s].
        xyz: Measured acceleration in the phone's axes [m/s^2].
        orientation: Orientation of its screen [deg].
    """

    stamp: float
    came: float
    at: float
    xyz: Triple
    orientation: int


@dataclass(frozen=True)
class MotionApp:
    """An app that took samples from some time on.

    Attributes:
        at: From when on [s].
        period: Nominal time between two samples [s].
        reference: In the phone's axes [m/s^2].
        ios: True if the signs are those of iOS.
        profile: Settings of reading, filter, mapping and sending.
    """

    at: float
    period: float
    reference: Triple
    ios: bool
    profile: PhoneProfile

    def line(self) -> str:
        """Return the sample as a line of the file."""
        about = {"at_s": self.at, "period_s": self.period, "reference_mps2": list(self.reference)}
        values = {**about, "ios": self.ios, "profile": self.profile.model_dump(mode="json")}
        return APP + json.dumps(values)


@dataclass
class PhoneMotion:
    """Contents of a motion file.

    Attributes:
        samples: In the order in which they came.
        apps: In the order of their times.
    """

    samples: list[MotionSample] = field(default_factory=list)
    apps: list[MotionApp] = field(default_factory=list)


class MotionWriter:
    """Writes a file, line by line; one that is full takes nothing more.

    Args:
        path: A new file.

    Attributes:
        name: Name of the file.

    Raises:
        OSError: it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.name = path.name
        self._file = path.open("x", encoding="utf-8", buffering=1)
        self._left = MAX_BYTES
        self._first = 0.0
        self._begun = False
        for line in (FIRST_LINE, *UNITS, COLUMNS):
            self._write(line)

    def app(self, app: MotionApp) -> None:
        """Let another app take the samples from now on."""
        self._write(app.line())

    def sample(self, sample: MotionSample) -> None:
        """Write one more sample."""
        if not self._begun:
            self._begun = True
            self._first = sample.stamp
        since_first = sample.stamp - self._first
        numbers = since_first, sample.came, sample.at, *sample.xyz
        self._write(",".join(map(repr, numbers)) + f",{sample.orientation}")

    def close(self) -> None:
        """Complete the file."""
        self._file.close()

    def _write(self, line: str) -> None:
        self._left -= len(line) + 1
        if self._left >= 0 and not self._file.closed:
            self._file.write(line + "\n")


def read_motion(path: Path) -> PhoneMotion:
    """Read a motion file.

    Raises:
        NoMotionOfOursError: it is none.
        ConfigError: it is damaged: file and line.
    """
    motion = PhoneMotion()
    try:
        with path.open(encoding="utf-8") as file:
            if file.readline().rstrip("\n") != FIRST_LINE:
                raise NoMotionOfOursError("is not a motion log of a phone", path, 1, 1)
            for number, line in enumerate(file, 2):
                _take(motion, line.rstrip("\n"), path, number)
    except UnicodeDecodeError:
        raise ConfigError("is not text", path) from None
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", path) from None
    return motion


def _take(motion: PhoneMotion, line: str, path: Path, number: int) -> None:
    try:
        if line.startswith(APP):
            motion.apps.append(_app(json.loads(line[len(APP) :])))
        elif line and not line.startswith("#") and line != COLUMNS:
            motion.samples.append(_sample(line))
    except (ValueError, KeyError, TypeError, RecursionError, ConfigError) as error:
        raise ConfigError(f"should be {COLUMNS}: {error}", path, number, 1) from None


def _sample(line: str) -> MotionSample:
    stamp, came, at, x, y, z, orientation = line.split(",")
    angle = int(orientation)
    if angle not in ORIENTATIONS:
        raise ValueError(f"orientation_deg {angle}")
    times = float(stamp), float(came), float(at)
    axes = float(x), float(y), float(z)
    bounds = zip((*times, *axes), (*(MAX_DURATION_S,) * 3, *(STRONGEST_MPS2,) * 3), strict=True)
    if not all(abs(value) <= bound for value, bound in bounds):
        raise ValueError("a value that no phone's sensor has")
    return MotionSample(*times, axes, angle)


def _app(content: dict[str, Any]) -> MotionApp:
    x, y, z = (float(part) for part in content["reference_mps2"])
    profile = validate(PhoneProfile, content["profile"], lambda problem, _: ConfigError(problem))
    at = float(content["at_s"])
    period = float(content["period_s"])
    if not (abs(at) <= MAX_DURATION_S and 1e-4 <= period <= MAX_DURATION_S):
        raise ValueError("an app at no time of a run")
    return MotionApp(at, period, (x, y, z), content["ios"] is True, profile)


def replayed(
    motion: PhoneMotion, looks: Iterator[float] | None = None, rate_hz: float = 10.0
) -> Iterator[tuple[float, TiltCommand]]:
    """Yield the commands that the apps of a file make of its samples, with their times [s].

    Args:
        motion: Content of the file.
        looks: Times at which the app was read; by default the app decides.
        rate_hz: Rate of commands, for an app that sends always.

    Raises:
        ConfigError: a filter or a mapping that cannot be had.
    """
    end = motion.samples[-1].came if motion.samples else 0.0
    if looks is not None:
        end = math.inf
    for number, app in enumerate(motion.apps):
        after = motion.apps[number + 1].at if number + 1 < len(motion.apps) else end
        yield from _by_app(motion, app, after, looks, rate_hz)


def _by_app(
    motion: PhoneMotion, app: MotionApp, until: float, looks: Iterator[float] | None, rate_hz: float
) -> Iterator[tuple[float, TiltCommand]]:
    waiting = iter([sample for sample in motion.samples if sample.came >= app.at])
    tilt = _made(app, 0)
    sample = next(waiting, None)
    turned = 0
    now = app.at
    while now <= until and now < math.inf:
        while sample is not None and sample.came <= now:
            if sample.orientation != turned:
                turned = sample.orientation
                tilt = _made(app, sample.orientation)
            tilt.sample(sample.at, to_tilt_axes(sample.xyz, sample.orientation, app.ios))
            sample = next(waiting, None)
        command = tilt.look(now)
        if command is not None:
            yield now, command
        now = tilt.next_look(now, rate_hz) if looks is None else next(looks, math.inf)


def _made(app: MotionApp, orientation: int) -> MeasuredTilt:
    reference = to_tilt_axes(app.reference, orientation, app.ios)
    tilt = MeasuredTilt(app.profile, reference, app.period)
    tilt.pick_up(app.at)
    return tilt
