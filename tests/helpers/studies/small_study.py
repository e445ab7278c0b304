"""Small studies with cheap episodes, and a runner that can be killed from outside.

Run as `python -m small_study STUDY OUT JOBS` it prints the number of runs done so far.
"""

import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dva_sim.experiments import runner
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.study import Study
from dva_sim.options.studies import RunOptions
from dva_sim.simulation.models import Tables

STUDY = """\
question: Which is quicker?
seed: 3
persons: 3
replications: 2
factors:
  pattern: [req-rep, latest-wins]
  link.delay_s: [0, 0.25]
parts:
  drive:
    scenario: one.yaml
    reference: {operator.strategy: oracle}
  story:
    scenario: one.yaml
    replications: 1
answer:
  part: drive
  measure: drive_time_s
  factor: pattern
  contrast: [req-rep, latest-wins]
  over: link.delay_s
  smallest_effect_s: 2.0
"""
RUNS = 6 + 4 * 6 + 4 * 3

BUSY_S = 0.1

REPEATED = (
    STUDY
    + """\
robustness:
  sets: 3
  bands: bands.yaml
  persons: 2
  replications: 2
"""
)
BANDS = "bands: {crossover_rad_s: [1.0, 2.0], hand_lag_s: [0.1, 0.2]}\n"
REPEATED_RUNS = RUNS + 3 * 2 * 4  # with the usual parameters they are runs of the part itself
TREATED = STUDY.replace("pattern: [req-rep, latest-wins]", "remedy: [none, both]").replace(
    "factor: pattern\n  contrast: [req-rep, latest-wins]",
    "factor: remedy\n  contrast: [none, both]",
)
TREATED += """\
treatments:
  remedy:
    none: {pattern: req-rep}
    both: {pattern: latest-wins, robot.processing_s: 0.01}
"""
PREDICTED = (
    STUDY
    + """\
predictions:
  - text: Waiting costs.
    direction: above
    expects_s: [3, 9]
    at: {link.delay_s: 0.25}
  - text: Nobody will notice.
"""
)
COMPARED = (
    STUDY
    + """\
comparisons:
  far: {part: drive, measure: contacts, factor: pattern, contrast: [req-rep, latest-wins],
    within: {link.delay_s: 0.25}, family: aside}
hypotheses:
  waiting-costs: {direction: above, margin: 1.5, at: {link.delay_s: 0.25}}
  contacts-alike: {comparison: far, direction: same, margin: 0.5}
"""
)
FULL = STUDY + "full: {persons: 6, link.delay_s: [0, 0.25, 0.5], robot.processing_s: 0.1}\n"
SHIFT = {
    "model": "timed",
    "area": {"width_m": 60, "height_m": 40},
    "responders": [
        {"name": "guard", "count": 2, "base": [5, 5], "look": 5, "act": 30, "after": "recall"},
        {"name": "robot", "kind": "robot", "base": [55, 35], "speed_mps": 0.4, "after": "return"},
    ],
    "operators": {"count": 1},
    "demand": [{"between": {"law": "exponential", "mean_s": 120}, "false_share": 0.3}],
    "dispatch": {"escalate_after_s": 120, "containment": True},
    "warm_up_s": 300,
    "horizon_s": 3900,
}


def write_study(folder: Path, text: str = STUDY) -> Path:
    (folder / "one.yaml").write_text("description: one robot\nhorizon_s: 60\n")
    (folder / "bands.yaml").write_text(BANDS)
    path = folder / "study.yaml"
    path.write_text(text)
    return path


def study_in(folder: Path, *settings: str, text: str = STUDY) -> Study:
    return load_study(write_study(folder, text), settings)


def run_study(
    study: Study, out: Path, *, episode: Callable[[StudyJob], Tables] | None = None, **options: Any
) -> Path:
    """Run a study as it was loaded, without a report; its results folder."""
    asked = RunOptions(study.file, out, report=False, **options)
    return runner.run_study(asked, study=study, episode=episode).results.folder


def cheap(job: StudyJob) -> Tables:
    """Rows of every kind, with awkward floats, from the seed alone."""
    time = math.sqrt(job.seed) + job.scenario.link.delay_s
    run = {
        "drive_time_s": time,
        "confirmed": job.seed % 3 > 0,
        "round_trip_s": math.nan if job.seed % 2 else time / 7,
        "outcome": "confirmed" if job.seed % 3 else None,
        "contacts": job.seed % 5,
    }
    track = [{"t_s": 0.1 * i, "x_m": 1 / (i + 1)} for i in range(3)] if job.trial == 0 else []
    return {"runs": [run], "tracks": track}


def slower(job: StudyJob) -> Tables:
    """Run that is slow enough to be interrupted."""
    sum(math.sin(i) for i in range(200_000))
    return cheap(job)


def busy(job: StudyJob) -> Tables:
    """Run that takes a tenth of a second of CPU time."""
    end = time.thread_time() + BUSY_S
    while time.thread_time() < end:
        math.sin(1.0)
    return cheap(job)


def unlucky(job: StudyJob) -> Tables:
    """One run of the reference fails."""
    if job.is_reference and (job.person, job.trial) == (1, 0):
        raise RuntimeError("the robot fell\ninto a hole")
    return cheap(job)


def deadly(job: StudyJob) -> Tables:
    """One run always takes its process with it."""
    if job.part == "story" and job.cell == 2 and job.person == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return cheap(job)


def deadly_once(mark: Path, job: StudyJob) -> Tables:
    """One run takes its process with it, the first time only."""
    if job.part == "story" and job.cell == 2 and job.person == 1 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return cheap(job)


def stopped_once(mark: Path, job: StudyJob) -> Tables:
    """One run stops its process, the first time only, and nobody lets it go on."""
    if job.part == "story" and job.cell == 2 and job.person == 1 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGSTOP)
    return cheap(job)


def stalls(job: StudyJob) -> Tables:
    """One run never ends, and takes every exception for its own."""
    while job.part == "story" and job.cell == 2 and job.person == 1:
        try:
            time.sleep(0.01)
        except Exception:
            continue
    return cheap(job)


def never_comes_back(job: StudyJob) -> Tables:
    """One run waits below Python, where no exception reaches it."""
    if job.part == "story" and job.cell == 2 and job.person == 1:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
        threading.Event().wait()
    return cheap(job)


def files(folder: Path) -> dict[str, bytes]:
    """All that must be the same bytes."""
    names = [*sorted((folder / "tables").glob("*")), folder / "manifest.json"]
    return {path.name: path.read_bytes() for path in names}


def rows(folder: Path) -> list[int]:
    """Seeds of the runs in the table."""
    return [int(seed) for seed in Results.load(folder).table("runs")["seed"]]


def main() -> None:
    from helpers.studies import small_study  # by the name that other processes know it by

    study, out, jobs = sys.argv[1:]
    try:
        run_study(
            load_study(study),
            out,
            jobs=int(jobs),
            episode=small_study.slower,
            progress=lambda done, _: print(done, flush=True),
        )
    except KeyboardInterrupt as stop:
        print(stop, flush=True)
        sys.exit(130)


if __name__ == "__main__":
    # A shell's background job inherits an ignored Ctrl-C; this program is here to be stopped.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    main()
