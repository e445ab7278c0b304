"""One run: a process that starts both ends, emulates the link, and reports their notes.

It happens in a fresh interpreter with one thread, told what to do by one line of JSON (see
`start`). Its standard input stays open as long as somebody waits for the answer: when it closes,
the run ends. Each end is a process with a network of its own where packets are emulated. A
namespace here has no name: it ends with its process, and the process ends with the one that
started it. So no kill leaves anything behind. `run_job` starts such a process, waits
for its outcome, and says in one line why there is none.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import IO, Any

from dva_sim.network.emulator import linux_calls
from dva_sim.network.emulator.forwarder import (
    FORWARDER_PRIORITY,
    EmulatedLink,
    Forwarder,
    links_of,
)
from dva_sim.network.emulator.linux_calls import FAR_END, NEAR_END, End, open_tun
from dva_sim.network.emulator.needs import NEEDS, EmulatorError
from dva_sim.network.emulator.relay import Proxy
from dva_sim.network.emulator.report import LinkReport
from dva_sim.network.link import LinkConfig
from dva_sim.network.pattern_runs import Condition
from dva_sim.network.workload import FileNotes, Note
from dva_sim.validation.network.real_side.programs import (
    await_nothing,
    begin_nothing,
    run_counter,
    run_operator,
    run_robot,
    run_sender,
)

PROGRAM_PRIORITY = 10  # real-time, below the forwarder's
_PATIENCE_S = 20.0  # maximum time until a node is ready [s]

Program = Callable[[socket.socket, FileNotes], None]
"""Function that runs in a node, with a connection to its starter and a place for its notes."""


@dataclass(frozen=True)
class Node:
    """A process at one end.

    Attributes:
        name: `operator` or `robot`.
        pid: Process.
        ended: File descriptor that becomes readable when the process ends.
        channel: Connection to it.
        file: Descriptor of the file of its notes.
    """

    name: str
    pid: int
    ended: int
    channel: socket.socket
    file: int

    def hear(self) -> tuple[bytes, list[int]]:
        """Wait for the next message of the node; return it and the file descriptors with it.

        Raises:
            ChildProcessError: the node ended or sent nothing.
        """
        with contextlib.suppress(OSError):
            data, handed, *_ = socket.recv_fds(self.channel, 256, 1)
            if data:
                return data, handed
        raise ChildProcessError(f"the {self.name} did not become ready")

    def notes(self) -> list[Note]:
        """Return all notes of the process so far, in their order."""
        return FileNotes.read(os.pread(self.file, os.fstat(self.file).st_size, 0))

    def end(self) -> int:
        """Kill the process and wait for it; its exit code, negative if it was killed."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)
        status = os.waitpid(self.pid, 0)[1]
        self.channel.close()
        os.close(self.ended)
        return os.waitstatus_to_exitcode(status)


def start_node(name: str, program: Program) -> Node:
    """Return a process that runs a program and then ends.

    Args:
        name: Name of the process.
        program: Program to run.
    """
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    here.settimeout(_PATIENCE_S)
    file = os.memfd_create("notes")
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        here.close()
        _live(parent, program, there, FileNotes(file))
    there.close()
    return Node(name, pid, os.pidfd_open(pid), here, file)


def _live(parent: int, program: Program, channel: socket.socket, notes: FileNotes) -> None:
    """Run a node's process; never return."""
    code = 1
    try:
        linux_calls.die_with_parent(parent)
        gc.disable()  # a pause would look like delay
        linux_calls.be_punctual(PROGRAM_PRIORITY)
        program(channel, notes)
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


PORT = 5555
_STDIN = 0
LinkColumns = dict[str, float | int]
PACKETS = "packets"
PROXY = "proxy"
"""Kinds of link: whole packets between namespaces, or a relay of TCP over the loopback."""


@dataclass(frozen=True)
class EmulatedJob:
    """Job of one run.

    Attributes:
        program: `commands` for operator and robot, `probe` for the link's own check, `nothing`
            to see whether it can be set up.
        wire: The link.
        seed: Random seed of the link.
        bound_s: Maximum duration of the run [s].
        arguments: Arguments of the program.
        congestion: Congestion control of all TCP.
        link: `packets` or `proxy`.
        rootless: Take a user namespace also where root could do without.
    """

    program: str
    wire: LinkConfig = field(default_factory=LinkConfig)
    seed: int = 1
    bound_s: float = 10.0
    arguments: dict[str, Any] = field(default_factory=dict)
    congestion: str = "cubic"
    link: str = PACKETS
    rootless: bool = False

    def to_json(self) -> str:
        """Return one line."""
        return json.dumps(vars(self) | {"wire": self.wire.model_dump(mode="json")})

    @classmethod
    def from_json(cls, text: str) -> EmulatedJob:
        """Return the job of such a line."""
        data = json.loads(text)
        return cls(**data | {"wire": LinkConfig.model_validate(data["wire"])})


@dataclass(frozen=True)
class EmulatedOutcome:
    """Outcome of one run.

    Attributes:
        operator: Notes of the operator.
        robot: Notes of the robot.
        link: Columns of the emulator.
        way: Way in which the namespaces were made: `root`, `user namespace`, or `proxy` without
            any.
        realtime: Real-time priority was granted.
        problem: Reason of the failure; empty if it did not fail.
    """

    operator: list[Note] = field(default_factory=list)
    robot: list[Note] = field(default_factory=list)
    link: LinkColumns = field(default_factory=dict)
    way: str = ""
    realtime: bool = False
    problem: str = ""

    def to_json(self) -> str:
        """Return one line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> EmulatedOutcome:
        """Return the outcome of a line that the process printed."""
        data = json.loads(text)
        for end in ("operator", "robot"):
            data[end] = [Note(*note) for note in data[end]]
        return cls(**data)


class EmulatedCell:
    """One run, from set-up to the last kill.

    Args:
        way: Way in which this process got the right to make namespaces.
    """

    def __init__(self, job: EmulatedJob, link_kind: str) -> None:
        self._job = job
        self._way = link_kind
        self._nodes: list[Node] = []
        self._links = links_of(job.wire, job.seed)

    def play(self) -> EmulatedOutcome:
        """Set up, run, and end everything; problems become part of the outcome."""
        problem = ""
        realtime = False
        columns: LinkColumns = {}
        try:
            realtime = linux_calls.be_punctual(FORWARDER_PRIORITY)
            link, word = self._set_up()
            gc.disable()  # a pause would look like delay
            self._nodes[0].channel.send(word)
            problem = self._run(link)
            columns = columns_of(link.report())
            link.close()
        except OSError as error:
            problem = error.strerror or str(error)
        finally:
            codes = [node.end() for node in self._nodes]
            notes = [node.notes() for node in self._nodes] or [[], []]
        if not problem and codes[0] != 0:
            problem = "the operator failed"
        return EmulatedOutcome(notes[0], notes[-1], columns, self._way, realtime, problem)

    def _set_up(self) -> tuple[EmulatedLink[Any], bytes]:
        """Set up the link with both ends, and the operator's start message."""
        operator, robot = _programs(self._job)
        if self._job.link == PROXY:
            self._start("operator", operator)
            address, _ = self._start("robot", robot).hear()
            proxy = Proxy(self._links, address.decode())
            return proxy, proxy.address.encode()
        a = self._start("operator", _networked(operator, NEAR_END, self._job.congestion))
        b = self._start("robot", _networked(robot, FAR_END, self._job.congestion))
        tuns = (a.hear()[1][0], b.hear()[1][0])
        return Forwarder(tuns, self._links), b.hear()[0]

    def _start(self, name: str, program: Program) -> Node:
        self._nodes.append(start_node(name, program))
        return self._nodes[-1]

    def _run(self, link: EmulatedLink[Any]) -> str:
        """Run both ends until the operator's program ends; return an error, or ""."""
        operator, robot = self._nodes
        watched = [operator.ended, robot.ended, _STDIN]
        end = link.run(watched, time.monotonic() + self._job.bound_s)
        if end is None:
            return f"the run did not come to an end within {self._job.bound_s:g} s"
        if end == _STDIN:
            return "nobody waits for the answer any more"
        return "the robot failed" if end == robot.ended else ""


def columns_of(report: LinkReport) -> LinkColumns:
    """Return the columns of the emulator, by the letters of both ends: a is the operator."""
    columns: LinkColumns = {}
    for direction, flow in (("ab", report.up), ("ba", report.down)):
        columns[f"emu_pkts_{direction}"] = flow.offered_packets
        columns[f"emu_lost_{direction}"] = flow.lost_by_chance
        columns[f"emu_tail_{direction}"] = flow.lost_in_queue
    for name in ("p50", "p99", "max"):
        columns[f"emu_late_{name}_ms"] = 1e3 * float(getattr(report, f"late_{name}_s"))
    return columns


def _networked(program: Program, end: End, congestion: str) -> Program:
    """Return the program in its own network namespace; its TUN device goes to the caller."""

    def run(channel: socket.socket, notes: FileNotes) -> None:
        linux_calls.enter_network_namespace()
        tun = open_tun(end, congestion)
        socket.send_fds(channel, [b"device"], [tun])
        os.close(tun)
        program(channel, notes)

    return run


def _programs(job: EmulatedJob) -> tuple[Program, Program]:
    """Return programs of both ends: the operator's and the robot's."""
    arguments = job.arguments
    if job.program == "commands":
        condition = Condition(**arguments)
        where = "127.0.0.1:*" if job.link == PROXY else f"{FAR_END.address}:{PORT}"
        return (
            lambda channel, notes: run_operator(condition, channel, notes),
            lambda channel, notes: run_robot(condition, f"tcp://{where}", channel, notes),
        )
    if job.program == "probe":
        return (
            lambda channel, notes: run_sender(channel, notes, FAR_END.address, **arguments),
            lambda channel, notes: run_counter(channel, notes, FAR_END.address),
        )
    return begin_nothing, await_nothing


_SLACK_S = 30.0  # time for starting and ending the processes [s]


def run_job(job: EmulatedJob) -> EmulatedOutcome:
    """Run a job in a process of its own, which is ended with all its children in any case.

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
        output = _text(out)
        complaint = _text(err)
    if not output:
        raise EmulatorError(f"the run ended without an answer: {_last_line(complaint)}")
    outcome = EmulatedOutcome.from_json(output)
    if outcome.problem:
        raise EmulatorError(": ".join(filter(None, (outcome.problem, _last_line(complaint)))))
    return outcome


def start_job(job: EmulatedJob, out: IO[bytes], err: IO[bytes]) -> subprocess.Popen[bytes]:
    """Start the process of a job; it ends when its standard input closes.

    Args:
        out: Gets the outcome.
        err: Gets complaints.
    """
    process = subprocess.Popen(
        [sys.executable, "-m", "dva_sim.validation.network.real_side.start", str(os.getpid())],
        stdin=subprocess.PIPE,
        stdout=out,
        stderr=err,
        start_new_session=True,  # Ctrl-C must reach only the parent, which then ends this
    )
    assert process.stdin is not None
    process.stdin.write(f"{job.to_json()}\n".encode())
    process.stdin.flush()
    return process


def why_no_packets() -> str:
    """Return a line with the reason why packets cannot be emulated here; empty if they can."""
    if sys.platform != "linux":
        return f"the emulated link {NEEDS}; this is {sys.platform}"
    try:
        run_job(EmulatedJob("nothing"))
    except EmulatorError as error:
        return f"the emulated link {NEEDS}; here {error}"
    return ""


def refuse_for_proxy(job: EmulatedJob) -> None:
    """Reject a job that a relay cannot emulate.

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
