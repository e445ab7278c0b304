"""Programs that are killed: their commands, and the conditions on their files afterwards."""

import json
import re
import shutil
import socket
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from helpers.processes.command_line import call
from helpers.processes.programs import Program, Programs

from dva_sim.kernel.errors import ExitCode
from dva_sim.recordings.reading import read_recording

OUT = "out"
STUDY = """\
question: Which is quicker?
seed: 2027
persons: 3
replications: 1
factors:
  dispatch.policy: [random, nearest_idle]
parts:
  small:
    scenario: small-shift
answer:
  part: small
  measure: response_mean_s
  factor: dispatch.policy
  contrast: [random, nearest_idle]
  smallest_effect_s: 2.0
"""
JUDGED = ExitCode.OK, ExitCode.NOT_JUDGED  # of what was cut short, facts may be missing
Files = dict[str, Any]


@dataclass(frozen=True)
class Subject:
    """A command.

    Attributes:
        words: Command line.
        product: Files of its folder, which must be the same as without a disturbance.
        prepare: Function that puts the required files into the folder.
        goes_on: True if the same command completes an interrupted one.
        ready: Output after which it is asked to end; empty: it ends by itself.
        worker: Exit code if one of its processes is killed.
        asked: Exit code if it is asked to end while it runs.
    """

    words: tuple[str, ...]
    product: Callable[[Path], Files] = lambda _: {}
    prepare: Callable[[Path], object] = lambda _: None
    goes_on: bool = True
    ready: str = ""
    worker: int = 3
    asked: int = 130


def study(folder: Path) -> None:
    (folder / "study.yaml").write_text(STUDY)


def finished(folder: Path) -> None:
    """Put results there, and no report."""
    study(folder)
    assert call("run", "study.yaml", "-o", OUT, "-j", "1", cwd=folder).returncode == 0
    shutil.rmtree(folder / OUT / "figures")
    (folder / OUT / "report.html").unlink()


def results(folder: Path) -> Files:
    """Tables, manifest, report and figures, all rows of the journal, and what is left behind."""
    out = folder / OUT
    files = [*out.glob("tables/*"), *out.glob("figures/*"), *out.glob("one-drive.*")]
    files += [out / "manifest.json", out / "report.html"]
    with closing(sqlite3.connect(out / "journal.sqlite")) as journal:
        rows = journal.execute("SELECT config, seed, tables FROM runs ORDER BY 1, 2").fetchall()
    made: Files = {str(path.relative_to(out)): path.read_bytes() for path in files}
    return made | {"journal": rows, "left": sorted(path.name for path in out.rglob(".*"))}


def storms(folder: Path) -> Files:
    """Each storm, with all that does not hang on the machine."""
    rows = map(json.loads, (folder / OUT / "storms.jsonl").read_text().splitlines())
    return {"storms": sorted(str(row | {"cpu_s": 0.0}) for row in rows)}


RECORDS = ("--record", f"{OUT}/run.mcap")
LIVE = ("live", "drive-to-event", "--operators", "scripted", *RECORDS)
CONSOLE = ("console", "--no-open", "--no-token", "--port", "0", "--audit", f"{OUT}/audit.sqlite")
RUN = ("run", "study.yaml", "-o", OUT)
SUBJECTS = {
    "study": Subject((*RUN, "-j", "1"), results, study),
    "study of workers": Subject((*RUN, "-j", "2"), results, study, worker=0),
    "report": Subject(("report", OUT), results, finished),
    "storms": Subject(("storm", "--seeds", "9:10", "-j", "1", "-o", OUT), storms),
    "storms of workers": Subject(("storm", "--seeds", "10", "-j", "2", "-o", OUT), storms),
    "demo": Subject(("demo", "-o", OUT, "-j", "2"), results, worker=0),
    "answers": Subject(("answers", "dispatch-oracle", "-j", "2")),
    "live": Subject(LIVE, goes_on=False, ready="mode Teleoperation", asked=0),
    "console": Subject((*CONSOLE, *RECORDS), goes_on=False, ready="Console: ", asked=0),
}


def wrong_recording(
    programs: Programs, program: Program, subject: Subject, said: str
) -> Iterator[str]:
    """Look at what a live run or a console has left: its recording, its audit, its ports.

    Whatever it had said is in the recording, and what is left can be replayed.
    """
    out = program.folder / OUT
    part, file = out / "run.mcap.part", out / "run.mcap"
    if part.exists():
        again = programs.start(*subject.words)
        if again.ends() != 2 or "dva-sim replay" not in "".join(again.complained):
            yield f"the next start says {again.complained}"
        file, left = out / "cut.mcap", part.read_bytes()
        replayed = call("replay", part, "--mcap", file)
        if replayed.returncode not in JUDGED:
            yield f"replay of {part.name}: {replayed.stderr}"
        if part.read_bytes() != left:
            yield f"replay has changed {part.name}"
    logs = out.glob("audit.sqlite") if subject.ready in program.output else ()
    for path in (file, *logs):
        if (checked := call("check", path)).returncode not in JUDGED:
            yield f"check {path.name}: {checked.stdout} {checked.stderr}"
    if file.exists():
        timeline = read_recording(file).playback.recorder.timeline
        told = re.findall(r"^ *[\d.]+ s  (.*)$", said, re.MULTILINE)
        kept = {f"{moment.who:<14} {moment.what}" for moment in timeline}
        yield from sorted(f"not recorded: {line}" for line in {*told} - kept)
    for port in {int(port) for port in re.findall(r"127\.0\.0\.1:(\d+)", program.output)}:
        try:
            socket.create_server(("127.0.0.1", port)).close()
        except OSError as error:
            yield f"port {port}: {error}"
