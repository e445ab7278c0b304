"""Requested pictures of a run: checked before the run, written after it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.kernel.whole_files import whole
from dva_sim.simulation.full import Playback
from dva_sim.simulation.scenario import Scenario

MOVING, STANDING, DRAWN = (".gif", ".mp4"), (".png", ".jpg"), (".png", ".pdf", ".svg")
MOST_PANELS = 24


@dataclass(frozen=True)
class Wanted:
    """Pictures of one run, or of several side by side.

    Attributes:
        video: A film, `.gif` or `.mp4`.
        still: One moment, `.png`, `.pdf` or `.svg`.
        strip: Several moments in one figure, likewise.
        at: The moments of still or strip [s], separated by commas; left out, the end for a
            still, or of two runs the moment when the first is done, and even steps for a strip.
        panels: Number of moments in a strip.
        camera: A robot by its label; the still is what its camera sees, `.png` or `.jpg`.
        inset: Show in the film what a robot's camera sees.

    Raises:
        ConfigError: what cannot be written, before anything is run.
    """

    video: Path | None = None
    still: Path | None = None
    strip: Path | None = None
    at: str | None = None
    panels: int = 6
    camera: str | None = None
    inset: bool = False

    @classmethod
    def of(
        cls,
        video: str | Path | None,
        still: str | Path | None,
        strip: str | Path | None,
        at: float | str | Sequence[float] | None,
        **others: Any,
    ) -> Wanted:
        """From options as programs and commands give them."""
        film, moment, moments = (None if p is None else Path(p) for p in (video, still, strip))
        return cls(film, moment, moments, None if at is None else joined(at), **others)

    def __post_init__(self) -> None:
        _check_path("video", self.video, MOVING)
        _check_path("still", self.still, STANDING if self.camera else DRAWN)
        _check_path("strip", self.strip, DRAWN)
        if self.video is not None and self.video.suffix.lower() == ".mp4":
            from dva_sim.recordings.pictures.film_files import find_ffmpeg  # late: start-up

            find_ffmpeg()
        if self.camera is not None and self.still is None:
            raise ConfigError("--camera needs --still: where to write the picture")
        if self.inset and self.video is None:
            raise ConfigError("--inset needs --video")
        if self.at is not None and self.still is None and self.strip is None:
            raise ConfigError("--at needs --still or --strip")
        if not 1 <= self.panels <= MOST_PANELS:
            raise ConfigError(f"--panels {self.panels} should be from 1 to {MOST_PANELS}")
        if self.still is not None and len(self.times) > 1 and self.strip is None:
            raise ConfigError("--still shows one moment; give --at one time, or use --strip")

    @property
    def any(self) -> bool:
        """True if anything is to be drawn."""
        return any(path is not None for path in (self.video, self.still, self.strip))

    @property
    def is_plain_still(self) -> bool:
        """True if one drawing is requested, without a particular moment or camera."""
        others = (self.video, self.strip, self.at, self.camera)
        return self.still is not None and all(other is None for other in others)

    @property
    def times(self) -> tuple[float, ...]:
        """The moments given [s].

        Raises:
            ConfigError: not numbers.
        """
        try:
            return tuple(float(part) for part in self.at.split(",")) if self.at else ()
        except ValueError:
            raise ConfigError(f"--at {self.at!r} should be seconds, as in 42 or 10,20,30") from None

    def check(self, scenario: Scenario) -> None:
        """Refuse what no run of a scenario has.

        Raises:
            ConfigError: a robot that is not there, or a moment before the run or past its horizon.
        """
        robots = [f"robot-{number}" for number in range(1, scenario.robot.count + 1)]
        if self.camera is not None and self.camera not in robots:
            raise ConfigError(f"--camera: {unknown('robot', self.camera, robots)}")
        for time in self.times:
            if not 0 <= time <= scenario.horizon_s:
                lasts = f"which lasts at most {scenario.horizon_s:g} s"
                raise ConfigError(f"--at {time:g} is not within the run, {lasts}")

    def write(self, recordings: Sequence[Playback]) -> Iterator[str]:
        """Write everything, and say of each what it is and where.

        Args:
            recordings: Runs made with `keep_traffic`; a camera is one of the first run.

        Raises:
            ConfigError: a moment after the run ended, or a failing ffmpeg.
        """
        from dva_sim.recordings.pictures import film_files, stills  # late: start-up
        from dva_sim.recordings.pictures.film import Film  # late: start-up

        stills.check_times(recordings, self.times)
        if self.still is not None:
            time = self.times[0] if self.times else stills.best_time(recordings)
            if self.camera is not None:
                stills.save_eye(recordings[0], self.camera, time, self.still)
            else:
                with whole(self.still) as part:
                    stills.still(recordings, time).savefig(part)
            yield f"Still: {self.still}"
        if self.strip is not None:
            times = self.times or stills.even_times(recordings, self.panels)
            with whole(self.strip) as part:
                stills.strip(recordings, times).savefig(part)
            yield f"Strip: {self.strip}"
        if self.video is not None:
            film_files.write_film(Film(recordings, self.inset), self.video)
            yield f"Video: {self.video}"


def joined(words: object) -> str:
    """One word or number, or several, as on the command line."""
    several = words if isinstance(words, list | tuple) else [words]
    return ",".join(map(str, several))


def _check_path(what: str, path: Path | None, endings: tuple[str, ...]) -> None:
    if path is None:
        return
    if path.suffix.lower() not in endings:
        allowed = f"{', '.join(endings[:-1])} or {endings[-1]}"
        raise ConfigError(f"--{what} {path.name!r} should end in {allowed}")
    if not path.parent.is_dir():
        raise ConfigError(f"folder {str(path.parent)!r} for the {what} does not exist")
