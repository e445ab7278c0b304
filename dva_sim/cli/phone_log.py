"""Prints the figures of a phone's motion file, and writes an accelerometer part from them."""

from __future__ import annotations

import json
import math
from pathlib import Path

from dva_sim.cli.verbosity import print_json
from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.motion import NoMotionOfOursError, PhoneMotion, read_motion, replayed
from dva_sim.recordings.motion_figures import MotionFigures, figures_of, part_of
from dva_sim.recordings.sensor_log import Unit, read_sensor_log


def tell(path: Path, as_json: bool, unit: Unit | None) -> None:
    """Print figures.

    Raises:
        ConfigError: it is no such file, or too short.
    """
    motion, guesses = _motion(path, unit)
    figures = figures_of(motion, path)
    if as_json:
        print_json(figures._asdict() | {"guesses": guesses})
        return
    for line in (*lines(figures), *map(_guessed, guesses)):
        print(line)


def _motion(path: Path, unit: Unit | None) -> tuple[PhoneMotion, list[str]]:
    """Read samples from a console's file or a logger app's, and list units that were guessed."""
    try:
        return read_motion(path), []
    except NoMotionOfOursError:
        log = read_sensor_log(path, unit)
        return PhoneMotion(log.samples), list(log.guesses)


def _guessed(guess: str) -> str:
    return f"guessed: {guess}"


def lines(figures: MotionFigures) -> list[str]:
    """Return the figures in words."""
    texts = [
        f"{figures.samples} samples in {figures.duration_s:.1f} s: {figures.rate_hz:.1f} a second, "
        f"jitter {100.0 * figures.jitter:.1f} %",
        f"gaps: {figures.gaps}, the longest interval {1000.0 * figures.longest_gap_s:.0f} ms",
        f"noise at rest {figures.noise_mg:.2f} mg, steps of {figures.resolution_mg:.3f} mg, "
        f"largest {figures.largest_g:.2f} g",
    ]
    if figures.late_ms is not None:
        texts.append(f"{figures.late_ms:.0f} ms from a sample to when it came")
    return texts


def tell_commands(path: Path, rate_hz: float) -> None:
    """Print the commands that the apps of a file make of its samples, separated by commas.

    Raises:
        ConfigError: it is no such file, or one of its apps cannot be made.
    """
    try:
        motion = read_motion(path)
    except NoMotionOfOursError:
        raise ConfigError(
            "has no app that makes commands: only a console's own files of motion have", path
        ) from None
    print("t_s,speed_mps,turn_rate_radps,sample_age_s")
    for now, command in replayed(motion, rate_hz=rate_hz):
        print(f"{now:.6f},{command.speed!r},{command.turn_rate!r},{command.sample_age:.6f}")


def write_part(path: Path, out: Path, unit: Unit | None) -> None:
    """Write an accelerometer part from the figures of a motion file.

    Raises:
        ConfigError: it is no such file, or `out` exists or cannot be written.
    """
    motion, guesses = _motion(path, unit)
    part = part_of(figures_of(motion, path))
    text = "".join(f"{key}: {_yaml(value)}\n" for key, value in part.items())
    try:
        with out.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise ConfigError("already exists", out) from None
    except OSError as error:
        raise ConfigError(f"cannot be written: {error.strerror}", out) from None
    for line in (*map(_guessed, guesses), f"{out} written: name it as phone.accelerometer"):
        print(line)


def _yaml(value: object) -> str:
    """Return a value as YAML, of which JSON is a part."""
    assert not (isinstance(value, float) and not math.isfinite(value))
    return json.dumps(value)
