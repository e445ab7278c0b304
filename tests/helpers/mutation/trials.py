"""Trials of planted faults: which test notices one, in a copy of the working tree.

A fault counts as noticed if a test fails with it, by itself too, and passes without it; or if
pytest breaks down or hangs.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import SimpleQueue

import pytest
from helpers.mutation.faults import Mutant
from helpers.mutation.scores import Trial
from helpers.paths import ROOT

PATIENCE_S = 900.0  # time-out for all tests of a room [s]
HANGS_AFTER_S = 60.0  # a test that takes longer hangs: the longest takes a few seconds
NOTHING_FAILED = (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)
QUICK, PROGRAMS = "not system and not soak and not browser", "system and not soak and not browser"
FAILED = re.compile(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", re.MULTILINE)
TESTS_OF = {"dva_sim": ("api",), "network": ("network", "contracts")}
"""Folders with the tests of a room that are not named as it is."""


def tests_of(mutant: Mutant, root: Path) -> tuple[list[str], list[str]]:
    """Return the files of tests of the fault's room: those of its module, and the others.

    The first are named as the module, or import it.
    """
    stem = mutant.module.stem
    dotted = ".".join(("dva_sim", *mutant.module.with_suffix("").parts)).removesuffix(".__init__")
    near, others = list[str](), list[str]()
    for room in TESTS_OF.get(mutant.room, (mutant.room,)):
        for file in sorted((root / "tests" / room).rglob("test_*.py")):
            is_near = stem in file.stem or dotted in file.read_text(encoding="utf-8")
            (near if is_near else others).append(str(file.relative_to(root)))
    return near, others


def copy_of_the_tree(root: Path) -> None:
    """Copy the files that Git knows, as they are in the working tree."""
    words = ["git", "-C", str(ROOT), "ls-files", "-co", "--exclude-standard"]
    for name in subprocess.check_output(words, text=True).splitlines():
        if (ROOT / name).is_file():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, root / name)
    subprocess.check_call(["git", "init", "-q", str(root)])


def notice(mutant: Mutant, root: Path, only_quick: bool) -> str:
    """Return the name of the test that notices a fault; empty if none does.

    The tests of its module come first; whole programs are started only if no other test notices.
    """
    every = tests_of(mutant, root)
    rounds = [(tests, marks) for marks in (QUICK, PROGRAMS)[: 2 - only_quick] for tests in every]
    names = (_notice(mutant, root, tests, marks) for tests, marks in rounds if tests)
    return next(filter(None, names), "")


def _notice(mutant: Mutant, root: Path, tests: Sequence[str], marks: str) -> str:
    left_out = list[str]()
    while True:
        with planted(mutant, root):
            code, failed = outcome(root, *tests, marks=marks, left_out=left_out)
            fails_alone = bool(failed) and outcome(root, failed)[0] != 0
        if not failed:
            return "" if code in NOTHING_FAILED else f"pytest ended with {code}"
        if fails_alone and outcome(root, failed)[0] == 0:
            return failed
        left_out.append(failed)


@contextmanager
def planted(mutant: Mutant, root: Path) -> Iterator[None]:
    """Keep a fault in a copy for a while."""
    file = root / mutant.file
    kept = file.read_bytes()
    put(file, mutant.in_place(kept))
    try:
        yield
    finally:
        put(file, kept)


def put(file: Path, source: bytes) -> None:
    """Write a module, of which nothing compiled is left."""
    file.write_bytes(source)
    for compiled in file.parent.glob(f"__pycache__/{file.stem}.*"):
        compiled.unlink()


def outcome(
    root: Path, *tests: str, marks: str = "not soak", left_out: Sequence[str] = ()
) -> tuple[int, str]:
    """Return the exit code of pytest, and the first test that failed."""
    words = ["-m", marks, f"--timeout={HANGS_AFTER_S}"]
    words += [f"--deselect={test}" for test in left_out]
    program = subprocess.Popen(
        [sys.executable, "-m", "pytest", "-x", "-p", "no:cacheprovider", *words, *tests],
        cwd=root,
        env=os.environ | {"PYTHONPATH": str(root)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        text, _ = program.communicate(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        text = ""
    finally:
        end(program)
    return program.returncode, next(iter(FAILED.findall(text)), "")


def end(program: subprocess.Popen[str]) -> None:
    """End a program with all that it started."""
    with suppress(ProcessLookupError):
        os.killpg(program.pid, signal.SIGKILL)
    program.wait()


def tried(mutants: Iterable[Mutant], jobs: int, only_quick: bool = False) -> Iterator[Trial]:
    """Try faults in copies of the tree; yield what came of each."""
    with tempfile.TemporaryDirectory() as folder:
        trees: SimpleQueue[Path] = SimpleQueue()
        for number in range(jobs):
            tree = Path(folder) / f"tree-{number}"
            copy_of_the_tree(tree)
            trees.put(tree)

        def try_out(mutant: Mutant) -> Trial:
            tree, began = trees.get(), time.monotonic()
            try:
                test = notice(mutant, tree, only_quick)
                return Trial(mutant.name, mutant.description, test, time.monotonic() - began)
            finally:
                trees.put(tree)

        with ThreadPoolExecutor(jobs) as pool:
            yield from pool.map(try_out, mutants)
