"""The program as users start it, and a list of everything that was started for a test."""

import os
import secrets
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from helpers.processes.patience import LOOK_S, PATIENCE_S, becomes

WIDE = "200"  # columns, so that no line is broken


def wait_until(condition: Callable[[], object], what: str) -> None:
    """Wait for as long as it takes.

    Raises:
        TimeoutError: it took too long; the message names `what`.
    """
    if not becomes(condition):
        raise TimeoutError(f"{what}: not within {PATIENCE_S:g} s")


class Program:
    """One `dva-sim` that runs; what it prints goes to files, so that it never has to wait."""

    def __init__(self, words: tuple[str, ...], folder: Path, environment: dict[str, str]) -> None:
        name = secrets.token_hex(4)
        self.folder = folder
        self._out, self._errors = folder / f"{name}.out", folder / f"{name}.errors"
        with self._out.open("wb") as out, self._errors.open("wb") as errors:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "dva_sim.cli", *words],
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=errors,
                cwd=folder,
                env=environment,
                start_new_session=True,  # what a test sends to it reaches nobody else
                # `nohup` around the tests would be inherited.
                preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),
            )

    @property
    def output(self) -> str:
        """Output so far."""
        return self._out.read_text()

    @property
    def complained(self) -> list[str]:
        """Lines of its standard error."""
        return self._errors.read_text().splitlines()

    def wait_to_say(self, *texts: str) -> None:
        """Wait until it has printed each of the texts."""
        for text in texts:
            wait_until(lambda t=text: t in self.output or self._has_ended, f"says {text!r}")
            assert text in self.output, f"ended without {text!r}: {self.output} {self.complained}"

    @property
    def _has_ended(self) -> bool:
        return self.process.poll() is not None

    def ends(self) -> int:
        """Its exit code, as soon as there is one."""
        wait_until(lambda: self._has_ended, "ends")
        assert self.process.returncode is not None
        return self.process.returncode

    def send(self, number: signal.Signals) -> None:
        self.process.send_signal(number)


class Programs:
    """Starts programs, knows all processes that came of them, and leaves none behind.

    Processes inherit a mark in their environment, also those that were started by others and
    have lost their parent; `/proc` shows it.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._mark = f"DVA_SIM_TEST={secrets.token_hex(16)}"
        self._started: list[Program] = []

    def start(self, *words: str | Path, **more: str) -> Program:
        """Start `dva-sim WORDS`, with more in its environment."""
        name, _, value = self._mark.partition("=")
        usual = {**os.environ, name: value, "COLUMNS": WIDE, "PYTHONUNBUFFERED": "1"}
        environment = usual | more
        program = Program(tuple(map(str, words)), self._folder, environment)
        self._started.append(program)
        return program

    def processes(self) -> dict[int, str]:
        """The command lines of all that live, by process id."""
        found = {}
        for entry in Path("/proc").iterdir():
            with suppress(OSError):
                if entry.name.isdigit() and self._is_ours(entry):
                    command = (entry / "cmdline").read_bytes().replace(b"\0", b" ")
                    found[int(entry.name)] = command.decode()
        return found

    def _is_ours(self, entry: Path) -> bool:
        """A process that has ended, but was not waited for, has no environment any more."""
        return self._mark.encode() in (entry / "environ").read_bytes().split(b"\0")

    def process_of(self, part: str) -> int:
        """The process that is a part of a live run, as soon as there is one."""
        wanted = f'"part": "{part}"'
        wait_until(lambda: any(wanted in c for c in self.processes().values()), f"{part} starts")
        return next(pid for pid, command in self.processes().items() if wanted in command)

    def wait_for_none(self) -> None:
        wait_until(lambda: not self.processes(), f"all end: {self.processes()}")

    def end_all(self) -> None:
        """End all processes in any case."""
        while processes := self.processes():
            for pid in processes:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            time.sleep(LOOK_S)
        for program in self._started:
            program.process.wait()


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Programs]:
    """Programs of one test, in its folder."""
    yield from all_gone_after(tmp_path)


def all_gone_after(folder: Path) -> Iterator[Programs]:
    """Yield programs, which are ended in any case."""
    programs = Programs(folder)
    try:
        yield programs
    finally:
        programs.end_all()
