"""Writing films: GIF by Pillow, MP4 by ffmpeg; a film that fails leaves no half file."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageColor

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.whole_files import whole
from dva_sim.recordings.pictures import style
from dva_sim.recordings.pictures.film import FPS, Film

COLOURS = 112  # colours of a GIF


COLOUR_TOLERANCE = 8  # change below which a pixel keeps its colour, of 255


SAMPLES = 6  # pictures from which the colours are chosen


def write_film(film: Film, path: Path) -> None:
    """Write a film; the ending of `path` decides the form.

    Raises:
        ConfigError: ffmpeg is missing or failed.
    """
    with whole(path) as part:
        (_write_gif if path.suffix.lower() == ".gif" else _write_mp4)(film, part)


def find_ffmpeg() -> str:
    """Return the path of ffmpeg: the one of the `imageio-ffmpeg` package, or else of the system.

    Raises:
        ConfigError: there is none.
    """
    try:
        import imageio_ffmpeg
    except ImportError:
        path = shutil.which("ffmpeg")
    else:
        path = imageio_ffmpeg.get_ffmpeg_exe()
    if path is None:
        raise ConfigError(
            "mp4 needs ffmpeg: pip install -e '.[video]', or install ffmpeg, or write a .gif"
        )
    return path


def _write_gif(film: Film, path: Path) -> None:
    # One palette, from pictures spread over the run, keeps the file small.
    times = [film.duration * (n + 1) / SAMPLES for n in range(SAMPLES)]
    samples = [Image.fromarray(film.at(time)) for time in times]
    sheet = Image.new("RGB", (samples[0].width, samples[0].height * SAMPLES))
    for number, sample in enumerate(samples):
        sheet.paste(sample, (0, number * sample.height))
    most = COLOURS - len(style.SMALL)
    common = sheet.quantize(most, Image.Quantize.MEDIANCUT).getpalette() or []
    # Few pixels show a robot: left to chance, its colour would be lost.
    palette = Image.new("P", (1, 1))
    palette.putpalette(common[: 3 * most] + [v for c in style.SMALL for v in ImageColor.getrgb(c)])
    pictures = [
        Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)
        for frame in _steady(film.frames())
    ]
    pictures[0].save(
        path, save_all=True, append_images=pictures[1:], duration=1000 // FPS, loop=0, optimize=True
    )


def _steady(frames: Iterator[NDArray[np.uint8]]) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures without changes too small to see, since equal pixels take no space."""
    previous = next(frames)
    yield previous
    for frame in frames:
        red, green, blue = np.moveaxis(
            np.abs(frame.astype(np.int16) - previous) >= COLOUR_TOLERANCE, 2, 0
        )
        previous = np.where((red | green | blue)[:, :, None], frame, previous)
        yield previous


def _write_mp4(film: Film, path: Path) -> None:
    frames = film.frames()
    first = next(frames)
    command = [find_ffmpeg(), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{first.shape[1]}x{first.shape[0]}", "-r", str(FPS), "-i", "-"]
    # Most players want an even number of pixels and this order of colours.
    command += ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-c:v", "libx264"]
    command += ["-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart", str(path)]
    with TemporaryFile() as errors:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=errors)
        try:
            _feed(process, first.tobytes(), frames)
        finally:
            process.kill()  # where it has ended already, that does nothing
            process.wait()
        if process.returncode != 0:
            raise ConfigError(f"ffmpeg could not write the video: {_last_line(errors, process)}")


def _feed(process: subprocess.Popen[bytes], first: bytes, frames: Iterator[Any]) -> None:
    """Hand over all pictures; a pipe that breaks shows in how ffmpeg ended."""
    pipe = process.stdin
    assert pipe is not None
    try:
        with pipe:
            pipe.write(first)
            for frame in frames:
                pipe.write(frame.tobytes())
    except BrokenPipeError:
        pass
    process.wait()


def _last_line(stderr: IO[bytes], process: subprocess.Popen[bytes]) -> str:
    stderr.seek(0)
    lines = stderr.read().decode(errors="replace").strip().splitlines()
    if lines:
        return lines[-1]
    return f"it ended with {process.returncode}; a negative number is the signal that killed it"
