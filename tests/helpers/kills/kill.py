"""One kill: a program is halted at a moment of its progress, disturbed, and let go on.

Afterwards no process is left, one line says what to do, and a second start ends with the same
bytes as an undisturbed one.
"""

import json
import os
import re
import resource
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from helpers.kills.subjects import OUT, SUBJECTS, Subject, wrong_recording
from helpers.processes.programs import Program, Programs, all_gone_after, wait_until

HERE = Path(__file__).parent
NAMESPACE = ["unshare", "--map-root-user", "--mount"]
DISK = "size=64m"
SPARE_MB = 1  # more memory than it has at the moment
SAYS = "says"
AT_END = "os.rename"  # of a recording
ADVICE = re.compile(r"\bagain\b|same command|dva-sim (replay|report)|has ended by itself")
PROGRESS = re.compile(r"warning: |\d+ storms, |$")


class Moment(NamedTuple):
    """Moment of progress.

    Attributes:
        process: Part of the command line of the process that is stopped there.
        event: Event of `sys.audit` before which it stops; `says`: the program's output.
        word: Part of the arguments of that event, or of the output.
        count: Number of the matching event.
        done: Number of runs that are finished by then, if that is known.
    """

    process: str
    event: str
    word: str
    count: int = 1
    done: int = 0


class Kill(NamedTuple):
    """Row of the table: who, when, and what is done; `main` if to the program, not to its process.

    Attributes:
        is_quick: True if it is tried with each change.
    """

    subject: str
    moment: Moment
    deed: str
    is_quick: bool = False

    def __str__(self) -> str:
        who = self.moment.process.rpartition("dva_sim")[2].strip(' ."') or "program"
        what = f"{self.moment.event} {self.moment.word} {self.moment.count}"
        return f"{self.subject}: {self.deed}, at {what} of {who}"


# --- deeds -----------------------------------------------------------------------------


class Victim(NamedTuple):
    """Process that stands still, and the folder it writes into."""

    process: int
    out: Path


def sends(number: signal.Signals) -> Callable[[Victim], object]:
    return lambda victim: os.kill(victim.process, number)


def takes_memory(victim: Victim) -> None:
    pages = int(Path(f"/proc/{victim.process}/statm").read_text().split()[0])
    most = pages * os.sysconf("SC_PAGE_SIZE") + (SPARE_MB << 20)
    resource.prlimit(victim.process, resource.RLIMIT_AS, (most, most))


def fills_disk(victim: Victim) -> None:
    with (victim.out / "ballast").open("wb", buffering=0) as file, suppress(OSError):
        while file.write(bytes(4096)):
            pass


def fills_most(victim: Victim) -> None:
    """Leave room for the journal and the tables, and for a part of the figures."""
    (victim.out / "ballast").write_bytes(bytes(830_000))


def forbids_writing(victim: Victim) -> None:
    """Put the folder, read-only, over itself; who has a file open may go on writing to that."""
    mount("--bind", victim.out, victim.out)
    mount("-o", "remount,bind,ro", victim.out)


def sets_clock(seconds: int) -> Callable[[Victim], object]:
    return lambda victim: (victim.out.parent / "time").write_text(str(seconds))


def waits(_: Victim) -> None:
    time.sleep(1.0)


DEEDS: dict[str, Callable[[Victim], object]] = {
    "INT": sends(signal.SIGINT),
    "TERM": sends(signal.SIGTERM),
    "KILL": sends(signal.SIGKILL),
    "KILL, replaced": sends(signal.SIGKILL),
    "STOP": waits,
    "no memory": takes_memory,
    "full disk": fills_disk,
    "disk of 1 MB": fills_most,
    "read-only": forbids_writing,
    "clock back": sets_clock(-86_400),
    "clock forth": sets_clock(86_400),
}
ENDS = "INT", "TERM", "KILL"
MOUNTS = {"full disk", "disk of 1 MB", "read-only"}


def mount(*words: str | Path) -> None:
    subprocess.run(["mount", *words], check=True)


def mend(deed: str, out: Path) -> None:
    """Undo the deed."""
    (out.parent / "time").unlink(missing_ok=True)
    if deed == "read-only":
        subprocess.run(["umount", out], check=True)
    elif deed in MOUNTS:
        (out / "ballast").unlink(missing_ok=True)
        mount("-o", f"remount,{DISK}", out)


# --- consequences ----------------------------------------------------------------------


def troubles(kill: Kill, folder: Path, quiet: Path) -> list[str]:
    """Return a line for each fault.

    Args:
        kill: Row of the table.
        folder: Empty folder.
        quiet: Folder of runs without disturbance, which is filled as need be.
    """
    subject = SUBJECTS[kill.subject]
    out = folder / OUT
    out.mkdir()
    if kill.deed in MOUNTS - {"read-only"}:
        mount("-t", "tmpfs", "-o", "size=1m" if "1 MB" in kill.deed else DISK, "tmpfs", out)
    subject.prepare(folder)
    for programs in all_gone_after(folder):
        try:
            return list(_troubles(kill, subject, programs, folder, quiet))
        finally:
            programs.end_all()
            if kill.deed in MOUNTS - {"read-only"}:
                subprocess.run(["umount", out], check=True)
    return []


def _troubles(
    kill: Kill, subject: Subject, programs: Programs, folder: Path, quiet: Path
) -> Iterator[str]:
    program = programs.start(*subject.words, **_environment(kill, folder))
    if (process := _reached(kill.moment, subject, programs, program)) is None:
        yield f"ended before that: {program.output} {program.complained}"
        return
    said = program.output
    victim = program.process.pid if "main" in kill.deed else process
    is_main = victim == program.process.pid
    DEEDS[kill.deed.removesuffix(" of main")](Victim(victim, folder / OUT))
    with suppress(ProcessLookupError):
        os.kill(process, signal.SIGCONT)
    if subject.ready and kill.deed not in ENDS and kill.moment.event != AT_END:
        _ask_to_end(program, subject)
    code = program.ends()
    yield from _wrong_end(kill, subject, is_main, code, program.complained)
    programs.wait_for_none()
    mend(kill.deed, folder / OUT)
    if not subject.goes_on:
        yield from wrong_recording(programs, program, subject, said)
        return
    expected = undisturbed(kill.subject, quiet)
    if code == 0:
        if (made := subject.product(folder)) != expected:
            yield f"differs although it is done: {_different(made, expected)}"
        return
    again = programs.start(*subject.words)
    if again.ends() or any(line.startswith("error") for line in again.complained):
        yield f"again it ended with {again.process.returncode}: {again.complained}"
    elif (made := subject.product(folder)) != expected:
        yield f"differs in {_different(made, expected)}"
    kept = re.search(r"(\d+) of them done already", again.output)
    if kill.moment.done > (int(kept[1]) if kept else 0):
        yield f"less than {kill.moment.done} runs were kept: {again.output}"


def _environment(kill: Kill, folder: Path) -> dict[str, str]:
    process, event, word, count, _ = kill.moment
    stops = json.dumps([process, event, word, count, str(folder / "stopped")])
    path = [str(HERE / "hook"), os.environ.get("PYTHONPATH", "")]
    more = {"DVA_SIM_STOPS": stops, "PYTHONPATH": os.pathsep.join(filter(None, path))}
    if kill.deed.startswith("clock"):
        library = folder / "other_time.so"
        words = ["cc", "-shared", "-fPIC", "-o", library, HERE / "other_time.c"]
        subprocess.run(words, check=True)
        more |= {"LD_PRELOAD": str(library), "OTHER_TIME": str(folder / "time")}
    return more


def _ask_to_end(program: Program, subject: Subject) -> None:
    wait_until(lambda: subject.ready in program.output or _has_ended(program), subject.ready)
    if not _has_ended(program):
        program.send(signal.SIGINT)


def _has_ended(program: Program) -> bool:
    return program.process.poll() is not None


def _reached(moment: Moment, subject: Subject, programs: Programs, program: Program) -> int | None:
    """Return the process that stands still at the moment; None: the program ended before it."""
    mark = program.folder / "stopped"
    if subject.ready and moment.event == AT_END:
        _ask_to_end(program, subject)
    if moment.event == SAYS:
        program.wait_to_say(moment.word)
        commands = programs.processes().items()
        process = next(pid for pid, command in commands if moment.process in command)
        os.kill(process, signal.SIGSTOP)
        mark.write_text(str(process))
    is_there = lambda: mark.exists() and mark.read_text()  # noqa: E731
    wait_until(lambda: is_there() or _has_ended(program), "the moment comes")
    if not mark.exists():
        return None
    stat = Path(f"/proc/{mark.read_text()}/stat")
    wait_until(lambda: stat.read_text().rpartition(")")[2].split()[0] == "T", "it stands still")
    return int(mark.read_text())


def _wrong_end(
    kill: Kill, subject: Subject, is_main: bool, code: int, complained: list[str]
) -> Iterator[str]:
    """Look at the exit code, and at the one line that says what to do."""
    if kill.deed in ("KILL, replaced", "STOP", "clock back", "clock forth"):
        codes = {0}
    elif kill.deed.startswith("KILL") and is_main:
        codes = {-signal.SIGKILL}
    elif kill.deed.startswith(("TERM", "INT")) and is_main:
        codes = {subject.asked if kill.moment.event == SAYS else 130}
    elif kill.deed in ("KILL", "TERM"):
        codes = {subject.worker}
    else:
        codes = {0, 2, 3}
    if code not in codes:
        yield f"ended with {code}, not with one of {codes}"
    errors = [line for line in complained if not PROGRESS.match(line)]
    if len(errors) != (code not in (0, -signal.SIGKILL)):
        yield f"{len(errors)} lines after exit code {code}: {errors[-20:]}"
    elif errors and not (errors[0].startswith("error: ") and ADVICE.search(errors[0])):
        yield f"says not what to do: {errors[0]}"


def undisturbed(name: str, quiet: Path) -> dict[str, object]:
    """Return what a subject makes in peace."""
    subject = SUBJECTS[name]
    folder = quiet / name
    if not (folder / "done").exists():
        shutil.rmtree(folder, ignore_errors=True)
        (folder / OUT).mkdir(parents=True)
        subject.prepare(folder)
        for programs in all_gone_after(folder):
            program = programs.start(*subject.words)
            assert program.ends() == 0, program.complained
        (folder / "done").touch()
    return subject.product(folder)


def _different(made: dict[str, object], expected: dict[str, object]) -> list[str]:
    return sorted(key for key in made.keys() | expected if made.get(key) != expected.get(key))
