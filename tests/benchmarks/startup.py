"""Start-up cost of each command, child processes included.

Commands that work for long are given a name that nobody has: that is what they load until they
refuse it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.counting import FOLDER, Callgrind, Perf
from helpers.processes.other_version import RUNNING
from helpers.studies import synthetic_results as synthetic

NOBODY = "no-such-name"
COMMANDS = {
    "--help": "--help",
    "--version": "--version",
    "list": "list",
    "plugins": "plugins",
    "assumed": "assumed",
    "answers": "answers --help",
    "schema": "schema scenario",
    "check": "check {root}/experiments/scenarios/fire-drill.yaml",
    "site": "site show hall -o {out}/site.png",
    "new": "new {out}/mine",
    "keys": "keys {out}/keys drive-to-event",
    "demo": "demo -o {results}/manifest.json/demo",
    "show": "show {results}",
    "export": "export {results} -o {out}/runs.csv",
    "compare": "compare {results} {results}",
    "episode": "episode drive-to-event --set horizon_s=1",
    **{
        name: f"{name} {NOBODY}"
        for name in ("run", "register", "tune", "screen", "report", "replay")
    },
    "phone-log": f"phone-log {NOBODY}",
    **{name: f"{name} {NOBODY}" for name in ("live", "console", "validate", "storm")},
    "users": "users list --file {out}/users.json",
    "robot": f"robot {NOBODY}",
    "link": f"link {NOBODY} --near true --far true",
    "load": f"load --dva {NOBODY}",
}
PREFIX = "start-up: "
REPEATS = 3


def results_folder(folder: Path) -> Path:
    """Results that commands may read."""
    tables = {"runs": synthetic.drive_rows(4, 1), "tracks": synthetic.track_rows()}
    tables["events"] = synthetic.story_rows(4)
    return synthetic.write(folder, tables, synthetic.manifest(4, 1))


class Ended(NamedTuple):
    """Program that has ended.

    Attributes:
        pid: Its process.
        cpu_s: CPU time of all its processes [s].
        peak_mb: Most memory of the largest of them [MB].
    """

    pid: int
    cpu_s: float
    peak_mb: float


def started(words: list[str], environment: Mapping[str, str]) -> Ended:
    """Run a program to its end.

    Raises:
        RuntimeError: it crashed.
    """
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    with subprocess.Popen(words, env=environment, start_new_session=True, **pipes) as process:
        RUNNING.append(process)
        assert process.stderr is not None
        output = process.stderr.read().decode()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 2) or "Traceback" in output:
        raise RuntimeError(output.strip().splitlines()[-1])
    return Ended(process.pid, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)


def measured(
    name: str, counter: str, root: Path, environment: Mapping[str, str], *, repeats: int = REPEATS
) -> dict[str, Any]:
    """Instructions, where they are counted, and the least CPU time [s] of starting a command."""
    with tempfile.TemporaryDirectory() as folder:
        results = results_folder(Path(folder) / "results")
        environment = {**environment, FOLDER: folder}

        def words() -> list[str]:
            out = tempfile.mkdtemp(dir=folder)
            asked = COMMANDS[name].format(root=root, results=results, out=out)
            # Without -P the version in the current folder would be started, whoever is measured.
            return [sys.executable, "-P", "-m", "dva_sim.cli", *asked.split()]

        instructions: float | None = None
        try:
            cpu_s = min(started(words(), environment).cpu_s for _ in range(repeats))
            if counter == Perf.name:
                instructions = Perf().count(lambda: started(words(), environment).cpu_s)[1]
            elif counter == Callgrind.name:
                under = [*Callgrind.words(Path(folder), at_once=True), *words()]
                pid = started(under, environment).pid
                instructions = Callgrind.total(Path(folder) / str(pid))
        except RuntimeError as error:
            return {"case": PREFIX + name, "error": str(error)}
        return {"case": PREFIX + name, "instructions": instructions, "cpu_s": cpu_s}
