"""The accelerometer: from the angles of a phone to the samples that its app gets."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import chain, repeat
from math import cos, sin
from typing import Annotated, Final

import numpy as np
from pydantic import Field, model_validator

from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.read_once import read_once
from dva_sim.kernel.yaml_files import load_yaml

FOLDER: Final = "agents/accelerometers"
GRAVITY: Final = 9.80665  # source: ISO 80000-3: [m/s^2]
ROUNDING_TERM: Final = (
    1.5 * 2.0**52
)  # design: added and taken away, which rounds four times as fast
TICK: Final = 2.0**-12  # design: resolution of sample times [s]

NonNegative = Annotated[float, Field(ge=0)]
Positive = Annotated[float, Field(gt=0)]
Triple = tuple[float, float, float]


class AccelerometerPart(Config):
    """A part, with the numbers of its data sheet; `mg` are thousandths of gravity.

    A typical value of a data sheet is assumed to be a standard deviation.

    Attributes:
        data_sheet: Source of the numbers.
        assumed: Keys whose numbers are not in the data sheet.
        rate_hz: Samples per second.
        noise_density_ug: White noise [micro-g per root hertz]; with `bandwidth_hz`.
        bandwidth_hz: Bandwidth of the part's own low-pass filter.
        noise_mg: White noise of a sample, standard deviation; instead of the two before.
        offset_mg: Output at no acceleration, standard deviation over parts.
        offset_mg_per_k: Change of the offset with temperature.
        drift_mg_per_sqrt_min: Random walk of the output within a session.
        resolution_mg: Step of the output; 0: none.
        range_g: Maximum output in either direction.
    """

    description: str = ""
    data_sheet: str = ""
    assumed: tuple[str, ...] = ()
    rate_hz: Annotated[float, Field(gt=0, le=1000)] = 100.0
    noise_density_ug: NonNegative | None = None
    bandwidth_hz: Positive | None = None
    noise_mg: NonNegative | None = None
    offset_mg: NonNegative = 0.0
    offset_mg_per_k: NonNegative = 0.0
    drift_mg_per_sqrt_min: NonNegative = 0.0
    resolution_mg: NonNegative = 0.0
    range_g: Annotated[float, Field(ge=1.0)] = 2.0

    @model_validator(mode="after")
    def _one_noise(self) -> AccelerometerPart:
        density = self.noise_density_ug is not None, self.bandwidth_hz is not None
        if density[0] != density[1] or density[0] == (self.noise_mg is not None):
            forms = "noise_density_ug and bandwidth_hz, or noise_mg"
            raise ValueError(f"noise should be given as {forms}")
        for key in self.assumed:
            if key not in type(self).model_fields:
                raise ValueError(f"assumed names {key!r}, which is not a key of a part")
        return self

    @property
    def noise(self) -> float:
        """White noise of a sample, standard deviation [m/s^2]."""
        if self.noise_mg is not None:
            return 1e-3 * GRAVITY * self.noise_mg
        assert self.noise_density_ug is not None
        assert self.bandwidth_hz is not None
        return 1e-6 * GRAVITY * self.noise_density_ug * math.sqrt(self.bandwidth_hz)


@read_once(lambda name: [resources.find(name, FOLDER)])
def load_part(name: str) -> AccelerometerPart:
    """Return the part of that name, or in that file.

    Raises:
        ConfigError: the file does not exist or cannot be read.
    """
    document = load_yaml(resources.find(name, FOLDER))
    return validate(AccelerometerPart, document.data, document.error)


class Accelerometer:
    """One copy of a part, in one phone.

    Pitch forward and roll to the left turn gravity into the x and y axes of the phone; z looks
    out of the screen. A sample is that, wrong by an offset (of this copy, of this session, and
    slowly drifting) and by white noise, rounded to the part's step and cut off at its range.

    Args:
        rng: Random generator of this run: sessions, noise, drift, times.
        own: Random generator of the differences between copies of the part, the same in all runs of
            its owner; by default that of this run.
        rate_hz: Rate of samples for the app, if other than the part's.
        jitter: Standard deviation of the time of a sample, as a share of the time between two.
        warming: Standard deviation of a session's temperature, against the calibration's [K].
        block: Number of samples whose random numbers are drawn at once; no effect on results.

    Attributes:
        period: Mean time between two samples [s].
        offset: Initial offset of this copy [m/s^2].
        interval: Function that returns the time from one sample to the next [s]; called once for
            each.
    """

    def __init__(
        self,
        part: AccelerometerPart,
        rng: np.random.Generator,
        own: np.random.Generator | None = None,
        *,
        rate_hz: float | None = None,
        jitter: float = 0.0,
        warming: float = 5.0,
        block: int = 256,
    ) -> None:
        noise, times, self._sessions, spare = rng.spawn(4)
        self.period = 1.0 / (rate_hz or part.rate_hz)
        mg = 1e-3 * GRAVITY
        self.offset: Triple = tuple((own or spare).normal(0.0, mg * part.offset_mg, 3).tolist())
        self._warming = mg * part.offset_mg_per_k * warming
        self._drift = mg * part.drift_mg_per_sqrt_min * math.sqrt(self.period / 60.0)
        self._errors = self._drawn(noise, part.noise, block)
        self._step = mg * part.resolution_mg
        self._range = GRAVITY * part.range_g
        intervals = _intervals(times, self.period, jitter, block) if jitter else repeat(self.period)
        self.interval: Callable[[], float] = intervals.__next__
        self.begin_session()

    def begin_session(self) -> None:
        """Begin a session: the phone is warmer or colder than when it was calibrated."""
        x, y, z = self._sessions.normal(0.0, self._warming, 3).tolist()
        self._x = self.offset[0] + x
        self._y = self.offset[1] + y
        self._z = self.offset[2] + z

    def sample(self, pitch: float, roll: float) -> Triple:
        """Return the reading of a phone at rest at these angles [rad]: x, y, z [m/s^2]."""
        x, y, z = next(self._errors)
        flat = GRAVITY * cos(pitch)
        x += self._x + GRAVITY * sin(pitch)
        y += self._y + flat * sin(roll)
        z += self._z + flat * cos(roll)
        step = self._step
        most = self._range
        if step:
            x = (x / step + ROUNDING_TERM - ROUNDING_TERM) * step
            y = (y / step + ROUNDING_TERM - ROUNDING_TERM) * step
            z = (z / step + ROUNDING_TERM - ROUNDING_TERM) * step
        if -most < x < most and -most < y < most and -most < z < most:
            return x, y, z
        return _cut(x, most), _cut(y, most), _cut(z, most)

    def _drawn(self, rng: np.random.Generator, noise: float, block: int) -> Iterator[list[float]]:
        """Yield the noise and drift of each sample [m/s^2]."""

        def blocks() -> Iterator[list[list[float]]]:
            drift = np.zeros(3)
            while True:
                normals = rng.normal(size=(block, 6))
                steps = normals[:, 3:] * self._drift
                steps[0] += drift  # added up one after the other, so that a block changes no number
                walk = np.cumsum(steps, axis=0)
                drift = walk[-1]
                yield (walk + normals[:, :3] * noise).tolist()

        return chain.from_iterable(blocks())


def _intervals(
    rng: np.random.Generator, period: float, jitter: float, block: int
) -> Iterator[float]:
    """Yield times between samples [s], lateness cut off so that none overtakes another.

    It is in ticks of a clock.
    """

    def blocks() -> Iterator[list[float]]:
        last = 0.0
        most = 0.4 * period
        while True:
            cut = np.clip(rng.normal(0.0, jitter * period, block), -most, most)
            late = np.round(cut / TICK) * TICK
            yield (period + np.diff(late, prepend=last)).tolist()
            last = late[-1]

    return chain.from_iterable(blocks())


def _cut(value: float, most: float) -> float:
    return min(max(value, -most), most)
