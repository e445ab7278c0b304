"""A study that is killed at any moment, until it has come to its end.

Run as `python -m helpers.studies.interrupted_study FOLDER`; it prints what happened as JSON.
Children are forked: a kill costs no start.
"""

import json
import os
import random
import signal
import sqlite3
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from helpers.studies import small_study as kit

from dva_sim.experiments.execution import session
from dva_sim.experiments.results.folder_lock import FolderInUse
from dva_sim.experiments.study.cell_grid import StudyJob

KILLS_EACH = 40
KILLS_A_STUDY = 10
PAIRS = 10
SEED = 1


def run(out: Path, study: Any) -> None:
    kit.run_study(study, out, jobs=1, episode=reportable)


def run_after(out: Path, study: Any) -> None:
    """Run a study once no other process writes into the folder; killed ones do not."""
    while True:
        try:
            run(out, study)
        except FolderInUse:
            time.sleep(0.01)
        else:
            return


def reportable(job: StudyJob) -> kit.Tables:
    """Tables of a run that a report can use: tracks of nobody cannot be drawn."""
    return {"runs": kit.cheap(job)["runs"]}


# --- kills -----------------------------------------------------------------------------


def forked(work: Callable[[], None]) -> int:
    """A child that does the work and ends; its process id."""
    pid = os.fork()
    if pid == 0:
        try:
            work()
            os._exit(0)
        except BaseException as error:
            print(f"{type(error).__name__}: {error}", file=sys.stderr, flush=True)
            os._exit(1)
    return pid


def ended(pid: int) -> bool:
    """True if a child exited; False if it was killed."""
    _, status = os.waitpid(pid, 0)
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0, "a runner has failed"
    return not os.WIFSIGNALED(status)


class Dies:
    """Kills its own process at the n-th call of any function, in Python or in C."""

    def __init__(self, calls: int) -> None:
        self.left = calls

    def __call__(self, *_: object) -> None:
        self.left -= 1
        if self.left == 0:
            os.kill(os.getpid(), signal.SIGKILL)


def profiled(name: str, profile: Callable[..., None]) -> None:
    """Profile from the first call of a function of the session on; what precedes it is not counted.

    Before the journal is opened a study is read, compiled and described: many times as many calls
    as its cheap runs take, and none that a kill could hurt.
    """
    call = getattr(session, name)

    def watched(*arguments: Any) -> Any:
        sys.setprofile(profile)
        return call(*arguments)

    setattr(session, name, watched)


def killed_at_a_call(
    out: Path, study: Any, calls: int, runs: Callable[[Path, Any], None] = run
) -> int:
    """Counts from the moment when the journal is opened."""

    def work() -> None:
        profiled("_opened", Dies(calls))
        runs(out, study)

    return forked(work)


def killed_while_writing(out: Path, study: Any, calls: int) -> int:
    """Counts from the moment when the tables begin to be written."""

    def work() -> None:
        profiled("write_tables", Dies(calls))
        run(out, study)

    return forked(work)


def killed_by_the_clock(out: Path, study: Any, cpu_s: float) -> int:
    """By the kernel, wherever it is then: also within the database; no handler sees it coming."""

    def work() -> None:
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, cpu_s)
        run(out, study)

    return forked(work)


def calls_of(out: Path, study: Any) -> int:
    """The number of calls from the moment when the journal is opened until the study has ended."""
    opened, count = session._opened, Dies(0)
    profiled("_opened", count)
    try:
        run(out, study)
    finally:
        sys.setprofile(None)
        session._opened = opened
    return -count.left


def doubled(out: Path) -> bool:
    """True if the journal has more than one row for a run."""
    if not (out / "journal.sqlite").exists():
        return False
    journal = sqlite3.connect(out / "journal.sqlite")
    tables = {name for (name,) in journal.execute("SELECT name FROM sqlite_master")}
    found = journal.execute("SELECT config, seed FROM runs").fetchall() if "runs" in tables else []
    journal.close()
    return len(found) > len(set(found))


def kills(folder: Path) -> dict[str, Any]:
    """Kill runners until each way to be killed has happened often enough.

    A study that was killed some times may end in quiet and is compared; then another begins.
    """
    study, rng, seen = kit.study_in(folder), random.Random(SEED), Counter[str]()
    plain = folder / "plain"
    run(plain, study)
    whole, calls = kit.files(plain), calls_of(folder / "counted", study)
    begun = time.process_time()
    run(folder / "timed", study)
    took = time.process_time() - begun
    ways: dict[str, Callable[[Path], int]] = {
        "call": lambda out: killed_at_a_call(out, study, rng.randrange(1, calls)),
        "writing": lambda out: killed_while_writing(out, study, rng.randrange(1, calls // 2)),
        "clock": lambda out: killed_by_the_clock(out, study, rng.uniform(0.001, took)),
    }
    while wanted := [way for way in ways if seen[way] < KILLS_EACH]:
        out = folder / f"killed-{seen['ended']}"
        for _ in range(KILLS_A_STUDY):
            way = rng.choice(wanted)
            if ended(ways[way](out)):
                break
            seen[way] += 1
            seen["doubled"] += doubled(out)
        assert ended(forked(lambda out=out: run(out, study)))
        seen["ended"] += 1
        seen["equal"] += kit.files(out) == whole
        seen["doubled"] += doubled(out)
        seen["left behind"] += len([p for p in out.iterdir() if p.name.startswith(".")])
    return dict(seen) | pairs(folder, study, whole, calls, rng)


def pairs(folder: Path, study: Any, whole: Any, calls: int, rng: random.Random) -> dict[str, int]:
    """Two runners on one folder, one after the other, until the first was killed often enough.

    Where the other left it too little to do, it ends before it dies.
    """
    seen = Counter[str]()
    while seen["pairs killed"] < PAIRS:
        out = folder / f"pair-{seen['pairs']}"
        killed = killed_at_a_call(out, study, rng.randrange(1, calls), run_after)
        other = forked(lambda out=out: run_after(out, study))
        assert ended(other)
        seen["pairs"] += 1
        seen["pairs killed"] += not ended(killed)
        seen["pairs equal"] += kit.files(out) == whole
        seen["pairs doubled"] += doubled(out)
    return dict(seen)


if __name__ == "__main__":
    print(json.dumps(kills(Path(sys.argv[1]))))
