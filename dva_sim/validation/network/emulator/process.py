"""Starts the process of a run, waits for its outcome, and says in one line why there is none."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from typing import IO

from dva_sim.kernel.errors import DvaSimError
from dva_sim.validation.network.emulator.cell import PROXY, EmulatedJob, EmulatedOutcome

_SLACK_S = 30.0  # for starting and ending the processes
NEEDS = (
    "needs Linux, /dev/net/tun open for reading and writing, and network namespaces "
    "(as root, or where unprivileged user namespaces are allowed)"
)


class EmulatorError(DvaSimError):
    """A run on the emulated link came to nothing; another one may succeed."""


def run_job(job: EmulatedJob) -> EmulatedOutcome:
    """Run a job in a process of its own; whatever happens here, nothing of it is left.

    Raises:
        EmulatorError: it failed; the line says why.
    """
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = start_job(job, out, err)
        try:
            process.wait(job.bound_s + _SLACK_S)
        except subprocess.TimeoutExpired:
            raise EmulatorError(f"the run did not end within {job.bound_s:g} s") from None
        finally:
            process.kill()  # its children are killed with it
            process.wait()
            if process.stdin is not None:
                process.stdin.close()
        said, complaint = _text(out), _text(err)
    if not said:
        raise EmulatorError(f"the run ended without an answer: {_last_line(complaint)}")
    outcome = EmulatedOutcome.from_json(said)
    if outcome.problem:
        raise EmulatorError(": ".join(filter(None, (outcome.problem, _last_line(complaint)))))
    return outcome


def start_job(job: EmulatedJob, out: IO[bytes], err: IO[bytes]) -> subprocess.Popen[bytes]:
    """Start the process of a job; it ends when its standard input closes.

    Args:
        job: What to do.
        out: Gets the outcome.
        err: Gets complaints.
    """
    process = subprocess.Popen(
        [sys.executable, "-m", "dva_sim.validation.network.emulator.start", str(os.getpid())],
        stdin=subprocess.PIPE,
        stdout=out,
        stderr=err,
        start_new_session=True,  # Ctrl-C is for whoever waits, who then ends this
    )
    assert process.stdin is not None
    process.stdin.write(f"{job.to_json()}\n".encode())
    process.stdin.flush()
    return process


def why_no_packets() -> str:
    """One line that says why packets cannot be emulated here; empty where they can."""
    if sys.platform != "linux":
        return f"the emulated link {NEEDS}; this is {sys.platform}"
    try:
        run_job(EmulatedJob("nothing"))
    except EmulatorError as error:
        return f"the emulated link {NEEDS}; here {error}"
    return ""


def refuse_for_proxy(job: EmulatedJob) -> None:
    """Raise where a relay cannot do what is asked.

    Raises:
        EmulatorError: it would have to lose or reorder packets.
    """
    if job.link == PROXY and (job.wire.loss > 0 or job.wire.reorder):
        raise EmulatorError("a relay over the loopback can neither lose nor reorder packets")


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode(errors="replace").strip()


def _last_line(text: str) -> str:
    return text.splitlines()[-1] if text else ""
