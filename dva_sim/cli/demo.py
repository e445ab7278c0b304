"""The first minute: one drive under both patterns as a picture and a film, then the main study."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Final

from dva_sim.cli import study_runs
from dva_sim.cli.console import say
from dva_sim.cli.stories import episode
from dva_sim.cli.verbosity import loudness
from dva_sim.experiments.execution.executors import WorkerDied, WorkerProcess
from dva_sim.experiments.report.episode import EpisodeRequest
from dva_sim.kernel.errors import DvaSimError, ExitCode
from dva_sim.options.runs import EpisodeOptions
from dva_sim.options.studies import RunOptions

STUDY: Final = "req-rep-vs-pub-sub"
SCENARIO: Final = "drive-to-event"
SEED: Final = 11
DELAY: Final = "link.delay_s=1"
PATTERNS: Final = "req-rep,latest-wins"
PICTURE: Final = "one-drive.png"
FILM: Final = "one-drive.gif"
_PATIENCE_S: Final = 300.0  # maximum wait for a film that is unfinished when the study is done
_INTRODUCTION: Final = """\
An operator drives a robot to a fire by tilting a phone. Commands go to the robot by REQ/REP, which
waits for an answer to each, or by PUB/SUB, where the robot obeys the newest ("latest-wins").
What difference does it make on a slow network? First one drive, with one second of delay each way;
then the small version of the study that answers this: about a minute on two cores.
"""


def demo(out: Path, jobs: int | None) -> ExitCode:
    """Show one drive under both patterns, then run the main study's small version; how it ended.

    Args:
        out: Folder for the picture, the film, the results and their report.
        jobs: Processes for the study; by default one for each core.

    Raises:
        DvaSimError: the folder cannot be written, or holds results of something else.
    """
    began = time.monotonic()
    say(_INTRODUCTION)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DvaSimError(f"{out} cannot be written: {error.strerror}") from None
    still = out / PICTURE
    drive = EpisodeOptions(SCENARIO, SEED, set=[DELAY], side_by_side=PATTERNS, still=still)
    episode(EpisodeRequest(drive))
    say("")
    with _film_under_way(out / FILM):
        code = study_runs.run(RunOptions(STUDY, out, quick=True, jobs=jobs))
    if code in (ExitCode.OK, ExitCode.RUNS_FAILED):
        say(f"Took {time.monotonic() - began:.0f} s, and {sum(os.times()[:4]):.0f} s of CPU time.")
        say(f"In the terminal: dva-sim show {out}")
        say(f"The study at its published size takes ten minutes: dva-sim run {STUDY}")
    return code


@contextmanager
def _film_under_way(path: Path) -> Iterator[None]:
    """Make the film in another process meanwhile, and say when it is there; none is left behind."""
    if path.exists():
        say(f"Film: {path}")
        yield
        return
    part = path.with_name(f".{path.name}")  # half a film would pass for a whole one
    # The other one waits, in case that the first is killed.
    with closing(WorkerProcess()) as maker, closing(WorkerProcess()) as other:
        makers = maker, other
        teller = threading.Thread(target=_say_when_done, args=(makers, part, path), daemon=True)
        teller.start()
        try:
            yield
            teller.join(_PATIENCE_S)
        finally:
            for each in makers:
                each.kill()
            teller.join()
            part.unlink(missing_ok=True)


def _make_film(path: Path) -> str:
    """Draw the drive as a film; return why that was not possible, if it was not."""
    drive = EpisodeOptions(
        SCENARIO, SEED, set=[DELAY], side_by_side=PATTERNS, inset=True, video=path
    )
    try:
        with loudness(quiet=True):
            episode(EpisodeRequest(drive))
    except (DvaSimError, OSError) as error:
        return str(error)
    return ""


def _say_when_done(makers: Sequence[WorkerProcess], part: Path, path: Path) -> None:
    for maker in makers:
        with suppress(WorkerDied):
            if problem := maker.call(partial(_make_film, part)):
                say(f"No film: {problem}")
                return
            part.replace(path)
            say(f"Film: {path}")
            return
    say("No film: its process has ended; run the same command again")
