"""The operator's and the robot's programs: real commands over a transport, and what became of them.

Both ends run on one machine and so have one clock. Notes go to a file, one after the other, so that
they outlive a program that is killed.

Run as `python -m dva_sim.network.middleware.programs SIDE PLAN`.
"""

from __future__ import annotations

import gc
import os
import struct
import sys
import threading
import time
from enum import IntEnum
from pathlib import Path
from typing import Any, Final, NamedTuple

from pydantic import Field

from dva_sim.kernel.config import Config
from dva_sim.network.emulator.linux_calls import be_punctual
from dva_sim.network.middleware.ends import CommandTransport, Rendezvous, Side, TransportError
from dva_sim.network.middleware.registry import load_transport
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.messages import OK, Reply, SetTeleOp, make_message, make_set_tele_op

OPERATOR_ID: Final = "02:00:00:00:00:01"
ROBOT_ID: Final = "02:00:00:00:00:02"
SESSION: Final = 1
SPEED, TURN_RATE = 0.5, 0.1  # of every command [m/s], [rad/s]
NOON: Final = "12:00:00.000"  # nobody reads it: ages are by number
PROGRAM_PRIORITY: Final = 10  # real-time, below the link's
NOT_CONNECTED: Final = 3  # exit code
_PICTURE: Final = struct.Struct("q")


class ProgramNoteKind(IntEnum):
    """Kind of a note."""

    READY = 0
    SENT = 1
    REFUSED = 2  # the transport took nothing: an answer was due, or a queue was full
    APPLIED = 3
    OUTDATED = 4  # older than one that had arrived
    UNREADABLE = 5
    PICTURE_TAKEN = 6
    PICTURE_SHOWN = 7


class ProgramNote(NamedTuple):
    """Event of a command or picture, and its time by `time.monotonic` [s]."""

    kind: ProgramNoteKind
    number: int
    time: float


class ProgramNotes:
    """Notes in a file; may be added to by several threads.

    Args:
        path: The file; what was in it is lost.
    """

    _ROW: Final = struct.Struct("iqd")

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)

    def add(self, kind: ProgramNoteKind, number: int) -> None:
        """Note that something happens now."""
        os.write(self._file, self._ROW.pack(kind, number, time.monotonic()))

    @classmethod
    def read(cls, path: Path) -> list[ProgramNote]:
        """All whole notes of a file, in their order."""
        data = path.read_bytes()
        whole = data[: len(data) // cls._ROW.size * cls._ROW.size]
        return [
            ProgramNote(ProgramNoteKind(kind), number, at)
            for kind, number, at in cls._ROW.iter_unpack(whole)
        ]


class Plan(Config):
    """Instructions for both programs.

    Attributes:
        transport: Name, or a file and a class.
        options: Options of the transport.
        near: Address of the operator's machine.
        far: Address of the robot's.
        port: First of three ports in a row.
        folder: Folder that both write to: `near.notes`, `far.notes`, and the transport's own files.
        ready_by: Deadline for connecting both ends, by `time.monotonic` [s].
        until: Time at which the operator stops sending, by the same clock [s].
        command_hz: Commands per second.
        picture_hz: Pictures per second; 0 for none.
        picture_bytes: Size of a picture.
    """

    transport: str
    options: dict[str, Any] = Field(default_factory=dict)
    near: str
    far: str
    port: int = 5600
    folder: Path
    ready_by: float
    until: float
    command_hz: float = 20.0
    picture_hz: float = 0.0
    picture_bytes: int = 8_000

    def place(self) -> Rendezvous:
        """Return the addresses as a transport takes them."""
        return Rendezvous(self.near, self.far, self.port, self.folder, self.ready_by)


def command(number: int) -> bytes:
    """A command as the phone's app sends it, whose message id is its number."""
    body = make_set_tele_op(SPEED, TURN_RATE, number)
    return encode(make_message(ROBOT_ID, number, OPERATOR_ID, NOON, SESSION, body))


def reply_to(number: int, replies: int) -> bytes:
    """The robot's reply to a command, with how many it has made as its message id."""
    reply = Reply(number, OK, "")
    return encode(make_message(OPERATOR_ID, replies, ROBOT_ID, NOON, SESSION, reply))


class RobotProgram:
    """Obeys what is newer than everything before it, and sends pictures."""

    def __init__(self, transport: CommandTransport, plan: Plan, notes: ProgramNotes) -> None:
        self._notes = notes
        self._plan = plan
        self._newest = 0
        self._replies = 0
        self._turn = threading.Lock()
        self._end = transport.far(plan.place(), self._hear)

    def _hear(self, data: bytes) -> bytes | None:
        try:
            message = decode(data)
        except ProtocolError:
            self._notes.add(ProgramNoteKind.UNREADABLE, 0)
            return None
        if not isinstance(message.body, SetTeleOp):
            self._notes.add(ProgramNoteKind.UNREADABLE, message.message_id)
            return None
        with self._turn:
            is_new = message.message_id > self._newest
            self._newest = max(self._newest, message.message_id)
            self._replies += 1
        self._notes.add(
            ProgramNoteKind.APPLIED if is_new else ProgramNoteKind.OUTDATED, message.message_id
        )
        return reply_to(message.message_id, self._replies)

    def run(self) -> None:
        """Until killed, or some time after the operator has sent its last command."""
        plan = self._plan
        number = 0
        over = plan.until + 60.0
        period = 1.0 / (plan.picture_hz or 1.0)
        due = time.monotonic()
        filling = b"\xff" * (plan.picture_bytes - _PICTURE.size)
        while (now := time.monotonic()) < over:
            self._end.serve(min(due, over))
            if plan.picture_hz and now >= due:
                number += 1
                due += period
                self._notes.add(ProgramNoteKind.PICTURE_TAKEN, number)
                self._end.send(_PICTURE.pack(number) + filling)
            elif now >= due:
                due += period


class OperatorProgram:
    """Sends a command at every step of a grid, or the newest as soon as one can be sent."""

    def __init__(self, transport: CommandTransport, plan: Plan, notes: ProgramNotes) -> None:
        self._notes = notes
        self._plan = plan
        self._sent = 0
        self._end = transport.near(plan.place(), self._see)
        notes.add(ProgramNoteKind.READY, 0)

    def _see(self, data: bytes) -> None:
        self._notes.add(ProgramNoteKind.PICTURE_SHOWN, _PICTURE.unpack_from(data)[0])

    def run(self) -> None:
        """Until the plan says."""
        plan = self._plan
        waits = False
        start = time.monotonic()
        step = 0
        period = 1.0 / self._plan.command_hz
        while (now := time.monotonic()) < plan.until:
            is_due = now >= start + step * period
            if is_due or waits:
                waits = not self._offer(is_due)
            if is_due:
                step = int((now - start) / period) + 1
            self._end.serve(min(start + step * period, plan.until))
        self._end.close()

    def _offer(self, is_due: bool) -> bool:
        """Send what the phone says now; whether the transport takes it."""
        number = self._sent + 1
        self._notes.add(ProgramNoteKind.SENT, number)
        if self._end.send(command(number)):
            self._sent = number
            return True
        self._notes.add(ProgramNoteKind.REFUSED, number)
        return False


PROGRAMS: Final[dict[Side, type[OperatorProgram] | type[RobotProgram]]] = {
    "near": OperatorProgram,
    "far": RobotProgram,
}


def main(side: Side, text: str) -> int:
    """Run one side of a plan; its exit code."""
    plan = Plan.model_validate_json(text)
    transport = load_transport(plan.transport, plan.options)()
    be_punctual(PROGRAM_PRIORITY)
    gc.disable()  # a pause would look like delay
    try:
        PROGRAMS[side](transport, plan, ProgramNotes(plan.folder / f"{side}.notes")).run()
    except TransportError as error:
        print(error, file=sys.stderr)
        return NOT_CONNECTED
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))  # type: ignore[arg-type]
