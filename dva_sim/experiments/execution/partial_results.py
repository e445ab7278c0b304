"""What is known of a study while it runs: the runs of the persons who have all of theirs."""

from __future__ import annotations

import shutil
import tempfile
import weakref
from collections.abc import Iterable, Sequence
from pathlib import Path

from dva_sim.experiments.execution.checkpoint import FILE, Journal
from dva_sim.experiments.execution.tables import write_tables
from dva_sim.experiments.results.manifest import failures
from dva_sim.experiments.results.results import MANIFEST, TABLES, Results, digests
from dva_sim.experiments.study.cell_grid import Key, Run, runs_in
from dva_sim.kernel.errors import ConfigError, DvaSimError


def load_so_far(folder: str | Path) -> Results:
    """Open a results folder, also one whose study is still running or was interrupted.

    Of an unfinished study, only persons count who have all of their runs, so that every
    comparison is paired and no cell has other persons than its neighbour. The key `partial` of
    the manifest then tells how much is there.

    Raises:
        ConfigError: it is no results folder, or no person has all runs yet.
    """
    folder = Path(folder)
    if (folder / MANIFEST).exists() or not (folder / FILE).exists():
        return Results.load(folder)
    with Journal(folder, None, must_exist=True) as journal:
        return _so_far(folder, journal)


def _so_far(folder: Path, journal: Journal) -> Results:
    manifest = journal.manifest()
    if manifest is None:
        raise ConfigError(
            f"{folder} holds an unfinished study of another version of dva-sim, which can only "
            "be shown when it is complete"
        )
    every = runs_in(manifest)
    done, failed = journal.done(), journal.failures()
    whole = _of_whole_persons(every, done | failed.keys())
    keys = {run.key for run in every}
    if not any(run.key in done for run in whole):
        raise ConfigError(
            f"{folder}: {len(done & keys)} of {len(keys)} runs are done, and no person has all of "
            "theirs yet; try again in a while"
        )
    persons = len({run.person for run in whole})
    manifest["partial"] = {"done": len(done & keys), "of": len(keys), "persons": persons}
    manifest["runs"] = len({run.key for run in whole})
    manifest["failures"] = failures(whole, journal)
    aside = _tables_aside(whole, journal)
    manifest["tables"] = digests(aside / TABLES)
    results = Results(folder, manifest, aside)
    weakref.finalize(results, shutil.rmtree, aside, ignore_errors=True)
    return results


def _of_whole_persons(runs: Sequence[Run], ended: Iterable[Key]) -> list[Run]:
    """The runs of the persons of whom no run is left to make."""
    there = set(ended)
    unfinished = {run.person for run in runs if run.key not in there}
    return [run for run in runs if run.person not in unfinished]


def _tables_aside(runs: Sequence[Run], journal: Journal) -> Path:
    """Tables of some runs, in a folder of their own that does not disturb who still runs."""
    try:
        aside = Path(tempfile.mkdtemp(prefix="dva-sim-"))
    except OSError as error:
        raise DvaSimError(f"tables cannot be kept for a moment: {error.strerror}") from None
    try:
        write_tables(aside, runs, journal)
    except BaseException:
        shutil.rmtree(aside, ignore_errors=True)
        raise
    return aside
