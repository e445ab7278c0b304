"""Requested pictures of a run: checked before the run, written after it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.kernel.whole_files import whole
from dva_sim.options.runs import PictureOptions
from dva_sim.simulation.full import Playback
from dva_sim.simulation.scenario import Scenario

MOVING = (".gif", ".mp4")
STANDING = (".png", ".jpg")
DRAWN = (".png", ".pdf", ".svg")


@dataclass(frozen=True)
class Wanted:
    """Pictures of one run, or of several side by side.

    Attributes:
        video: A film, `.gif` or `.mp4`.
        still: One moment, `.png`, `.pdf` or `.svg`.
        at: The moment of the still [s]; by default the end, or of two runs the moment when the
            first is done.
        camera: A robot by its label; the still is what its camera sees, `.png` or `.jpg`.
        inset: Show in the film what a robot's camera sees.

    Raises:
        ConfigError: what cannot be written, before anything is run.
    """

    video: Path | None = None
    still: Path | None = None
    at: float | None = None
    camera: str | None = None
    inset: bool = False

    @classmethod
    def of(cls, options: PictureOptions) -> Wanted:
        """Return the wish from the options of `dva_sim.episode` and `dva_sim.replay`."""
        film, moment = (None if p is None else Path(p) for p in (options.video, options.still))
        at = None if options.at is None else _seconds(options.at)
        return cls(film, moment, at, options.camera, options.inset)

    def __post_init__(self) -> None:
        _check_path("video", self.video, MOVING)
        _check_path("still", self.still, STANDING if self.camera else DRAWN)
        if self.video is not None and self.video.suffix.lower() == ".mp4":
            from dva_sim.recordings.pictures.film_files import find_ffmpeg  # late: start-up

            find_ffmpeg()
        if self.camera is not None and self.still is None:
            raise ConfigError("--camera needs --still: where to write the picture")
        if self.inset and self.video is None:
            raise ConfigError("--inset needs --video")
        if self.at is not None and self.still is None:
            raise ConfigError("--at needs --still: where to write the picture")

    @property
    def any(self) -> bool:
        """True if anything is to be drawn."""
        return self.video is not None or self.still is not None

    @property
    def is_plain_still(self) -> bool:
        """True if one drawing is requested, without a particular moment or camera."""
        options = (self.video, self.at, self.camera)
        return self.still is not None and all(other is None for other in options)

    def check(self, scenario: Scenario) -> None:
        """Refuse cameras and moments that no run of a scenario has.

        Raises:
            ConfigError: a robot that is not there, or a moment before the run or past its horizon.
        """
        robots = [f"robot-{number}" for number in range(1, scenario.robot.count + 1)]
        if self.camera is not None and self.camera not in robots:
            raise ConfigError(f"--camera: {unknown('robot', self.camera, robots)}")
        if self.at is not None and not 0 <= self.at <= scenario.horizon_s:
            lasts = f"which lasts at most {scenario.horizon_s:g} s"
            raise ConfigError(f"--at {self.at:g} is not within the run, {lasts}")

    def write(self, recordings: Sequence[Playback]) -> Iterator[str]:
        """Write all requested files, and yield a line for each with its kind and path.

        Args:
            recordings: Runs made with `keep_traffic`; a camera is one of the first run.

        Raises:
            ConfigError: a moment after the run ended, or a failing ffmpeg.
        """
        from dva_sim.recordings.pictures import film_files, stills  # late: start-up
        from dva_sim.recordings.pictures.film import Film  # late: start-up

        if self.still is not None:
            time = stills.time_of_still(recordings, self.at)
            if self.camera is not None:
                stills.save_eye(recordings[0], self.camera, time, self.still)
            else:
                with whole(self.still) as part:
                    stills.still(recordings, time).savefig(part)
            yield f"Still: {self.still}"
        if self.video is not None:
            film_files.write_film(Film(recordings, self.inset), self.video)
            yield f"Video: {self.video}"


def joined(words: object) -> str:
    """Return one word or number, or several, as on the command line."""
    several = words if isinstance(words, list | tuple) else [words]
    return ",".join(map(str, several))


def _seconds(text: float | str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ConfigError(f"--at {text!r} should be seconds, as in 42") from None


def _check_path(what: str, path: Path | None, endings: tuple[str, ...]) -> None:
    if path is None:
        return
    if path.suffix.lower() not in endings:
        allowed = f"{', '.join(endings[:-1])} or {endings[-1]}"
        raise ConfigError(f"--{what} {path.name!r} should end in {allowed}")
    if not path.parent.is_dir():
        raise ConfigError(f"folder {str(path.parent)!r} for the {what} does not exist")
