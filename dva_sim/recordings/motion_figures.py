"""Properties of a phone's sensor from a motion file: rate, regularity, noise at rest."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from statistics import median, pstdev
from typing import Any, Final, NamedTuple

from dva_sim.agents.tilt.accelerometer import GRAVITY
from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.motion import MotionSample, PhoneMotion

GAP: Final = 3.0  # length of an interval that counts as a gap, in median intervals
REST_S: Final = 2.0  # length of the quietest stretch, which counts as rest [s]
MIN_SAMPLES: Final = 30  # minimum number of samples
MIN_STEP_S: Final = 1e-6  # nearer samples count as simultaneous [s]


class MotionFigures(NamedTuple):
    """Properties of the sensor.

    Attributes:
        samples: Number of samples.
        duration_s: Time from the first to the last [s].
        rate_hz: By the median of the intervals.
        jitter: Standard deviation of the intervals without gaps, as a share of their median.
        gaps: Intervals longer than three medians.
        longest_gap_s: The longest interval [s].
        late_ms: Median time from a sample to when it came [ms]; None if the file does not say.
        noise_mg: White noise of a sample at rest, mean of the axes, in thousandths of gravity: by
            the differences of neighbours, so that slow motion does not count.
        resolution_mg: Smallest step between two samples, likewise.
        largest_g: Largest acceleration along an axis, as a multiple of gravity.
    """

    samples: int
    duration_s: float
    rate_hz: float
    jitter: float
    gaps: int
    longest_gap_s: float
    late_ms: float | None
    noise_mg: float
    resolution_mg: float
    largest_g: float


def figures_of(motion: PhoneMotion, path: Path) -> MotionFigures:
    """Compute the properties of the sensor.

    Raises:
        ConfigError: it holds too few samples to tell anything.
    """
    samples = motion.samples
    if len(samples) < MIN_SAMPLES:
        raise ConfigError(
            f"contains {len(samples)} samples; at least {MIN_SAMPLES} are needed", path
        )
    steps = [step for a, b in pairwise(samples) if (step := b.stamp - a.stamp) >= MIN_STEP_S]
    if not steps:
        raise ConfigError("contains samples of one moment only", path)
    usual = median(steps)
    even = [step for step in steps if step <= GAP * usual]
    late = [sample.came - sample.at for sample in samples if not math.isnan(sample.came)]
    return MotionFigures(
        samples=len(samples),
        duration_s=samples[-1].stamp - samples[0].stamp,
        rate_hz=1.0 / usual,
        jitter=pstdev(even) / usual,
        gaps=len(steps) - len(even),
        longest_gap_s=max(steps),
        late_ms=1000.0 * median(late) if late else None,
        noise_mg=1000.0 * min(map(_noise, _stretches(samples, usual))) / GRAVITY,
        resolution_mg=1000.0 * _resolution(samples) / GRAVITY,
        largest_g=max(abs(part) for sample in samples for part in sample.xyz) / GRAVITY,
    )


def _stretches(samples: list[MotionSample], step: float) -> list[list[MotionSample]]:
    length = max(MIN_SAMPLES, round(REST_S / step))
    starts = range(0, max(1, len(samples) - length + 1), max(1, length // 4))
    return [samples[start : start + length] for start in starts]


def _noise(samples: list[MotionSample]) -> float:
    """White noise of a stretch [m/s^2]: the difference of two samples has twice the variance."""
    axes = list(zip(*(sample.xyz for sample in samples), strict=True))
    power = [
        sum((b - a) ** 2 for a, b in pairwise(axis)) / (2.0 * (len(axis) - 1)) for axis in axes
    ]
    return math.sqrt(sum(power) / len(power))


def _resolution(samples: list[MotionSample]) -> float:
    """Return the smallest step along an axis [m/s^2], except steps smaller than rounding."""
    smallest = math.inf
    for axis in zip(*(sample.xyz for sample in samples), strict=True):
        levels = sorted(set(axis))
        steps = (b - a for a, b in pairwise(levels) if b - a > 1e-9)
        smallest = min(smallest, min(steps, default=math.inf))
    return smallest if smallest < math.inf else 0.0


def part_of(figures: MotionFigures) -> dict[str, Any]:
    """Return an accelerometer part that measures as this one did; for `phone.accelerometer`."""
    return {
        "description": f"Measured: a phone's own part, by {figures.samples} samples of its motion.",
        "data_sheet": "none: by the differences of neighbouring samples at rest",
        "assumed": ["offset_mg", "drift_mg_per_sqrt_min", "range_g"],
        "rate_hz": round(min(1000.0, figures.rate_hz), 2),
        "noise_mg": round(figures.noise_mg, 3),
        "resolution_mg": round(figures.resolution_mg, 4),
        "range_g": float(max(2, math.ceil(figures.largest_g))),
    }
