"""Counters of retired instructions, which do not vary as time does.

The processor counts them itself if the system lets it (perf_event_open), else Valgrind's callgrind
does, fifty times slower. Where neither is to be had, only CPU time is measured.
"""

from __future__ import annotations

import ctypes
import os
import platform
import re
import shutil
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path

FOLDER = "BENCH_CALLGRIND"  # names the folder that callgrind writes into
SWITCH = "callgrind_control"  # part of Valgrind
OPEN = {"x86_64": 298, "aarch64": 241}  # the system call's number
INHERIT, NO_KERNEL, NO_HYPERVISOR = 1 << 1, 1 << 5, 1 << 6
HARDWARE_INSTRUCTIONS = (0, 1)  # type and what is counted, as in linux/perf_event.h
SOFTWARE_TASK_CLOCK = (1, 1)

Work = Callable[[], float]


class Unavailable(Exception):
    """Nothing counts in this way here; says why."""


class Perf:
    """The processor's counter, for this process and those that it starts.

    Args:
        event: Type and number of what is counted.

    Raises:
        Unavailable: the system has no such counter, or does not let us read it.
    """

    name = "perf_event_open"

    def __init__(self, event: tuple[int, int] = HARDWARE_INSTRUCTIONS) -> None:
        number = OPEN.get(platform.machine())
        if number is None or platform.system() != "Linux":
            raise Unavailable(f"not known on {platform.system()} {platform.machine()}")
        flags = INHERIT | NO_KERNEL | NO_HYPERVISOR
        attributes = struct.pack("=IIQQQQQIIQ", event[0], 64, event[1], 0, 0, 0, flags, 0, 0, 0)
        libc = ctypes.CDLL(None, use_errno=True)
        self._file = libc.syscall(number, attributes, 0, -1, -1, 0)
        if self._file < 0:
            raise Unavailable(os.strerror(ctypes.get_errno()))

    def __del__(self) -> None:
        if getattr(self, "_file", -1) >= 0:
            os.close(self._file)

    def read(self) -> int:
        """Count since this object was made."""
        return int.from_bytes(os.read(self._file, 8), "little")

    def count(self, work: Work) -> tuple[float, int]:
        """Result of the work, and its instructions."""
        before = self.read()
        done = work()
        return done, self.read() - before


class Callgrind:
    """Valgrind's counter, in a process that was started by `words`.

    It counts only while it is asked to: what is not counted runs several times as fast. A call of
    getpriority, which nobody else makes, closes one account and opens the next.
    """

    name = "callgrind"

    @staticmethod
    def words(folder: Path, at_once: bool = False) -> list[str]:
        """Command prefix that counts a process; the count is written to `folder/PID`.

        Args:
            folder: Folder for the counts.
            at_once: The whole process is counted.
        """
        options = ["--dump-before=getpriority", f"--callgrind-out-file={folder}/%p"]
        # Copies of a process can only be switched if children are followed.
        switched = ["--instr-atstart=no", "--trace-children=yes"]
        options += [] if at_once else [*switched, f"--trace-children-skip=*{SWITCH}"]
        return ["valgrind", "-q", "--tool=callgrind", *options]

    @staticmethod
    def total(file: Path) -> int:
        """The instructions of an account."""
        found = re.search(r"^totals: (\d+)", file.read_text(), re.MULTILINE)
        if found is None:
            raise Unavailable(f"callgrind wrote no total into {file}")
        return int(found[1])

    @staticmethod
    def _switch(word: str) -> None:
        words = [SWITCH, "-i", word, str(os.getpid())]
        subprocess.run(words, check=True, capture_output=True)

    def count(self, work: Work) -> tuple[float, int]:
        """Result of the work, and its instructions."""
        self._switch("on")
        os.getpriority(os.PRIO_PROCESS, 0)
        done = work()
        os.getpriority(os.PRIO_PROCESS, 0)
        self._switch("off")
        accounts = list(Path(os.environ[FOLDER]).glob(f"{os.getpid()}.*"))
        last = max(accounts, key=lambda file: int(file.suffix[1:]))
        return done, self.total(last)


class Nothing:
    """No counter."""

    name = "CPU time alone"

    @staticmethod
    def count(work: Work) -> tuple[float, None]:
        """Result of the work."""
        return work(), None


COUNTERS: dict[str, type[Perf | Callgrind | Nothing]] = {
    kind.name: kind for kind in (Perf, Callgrind, Nothing)
}


def available() -> tuple[str, str]:
    """The best counter that this machine has, and why not a better one."""
    try:
        Perf()
    except Unavailable as why:
        without = f"perf_event_open: {why}"
    else:
        return Perf.name, ""
    if shutil.which("valgrind"):
        return Callgrind.name, without
    return Nothing.name, f"{without}; callgrind: no valgrind (Debian: apt-get install valgrind)"


def pinned() -> dict[str, str]:
    """The environment of what is measured: nothing in it depends on chance or on the processor.

    Words are hashed alike, NumPy takes the code that every processor can run, and no library
    starts threads.
    """
    from numpy._core._multiarray_umath import __cpu_dispatch__ as above_all  # type: ignore

    fixed = {
        "PYTHONHASHSEED": "0",
        "NPY_DISABLE_CPU_FEATURES": " ".join(above_all),
        "OPENBLAS_CORETYPE": "Nehalem",
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "MPLBACKEND": "Agg",
        "COLUMNS": "100",
    }
    inherited = {key: text for key, text in os.environ.items() if not key.startswith("PYTHON")}
    return inherited | fixed
