"""The operator's and the robot's programs over a real transport, whose notes go to files.

Both ends run on one machine and so have one clock.

Run as `python -m dva_sim.network.middleware.programs SIDE PLAN`.
"""

from __future__ import annotations

import gc
import itertools
import os
import struct
import sys
import time
from pathlib import Path
from typing import Any, Final

from pydantic import Field
from typing_extensions import override

from dva_sim.kernel.config import Config
from dva_sim.network.emulator.linux_calls import be_punctual
from dva_sim.network.middleware.ends import (
    CommandTransport,
    Rendezvous,
    Side,
    TransportEnd,
    TransportError,
)
from dva_sim.network.middleware.registry import load_transport
from dva_sim.network.realtime import ProgramClock
from dva_sim.network.workload import (
    FileNotes,
    MessageForm,
    NoteKind,
    OperatorEnd,
    OperatorWorkload,
    RobotWorkload,
)
from dva_sim.protocol.codec import decode_if_valid, encode
from dva_sim.protocol.messages import OK, Reply, SetTeleOp, make_message, make_set_tele_op

OPERATOR_ID: Final = "02:00:00:00:00:01"
ROBOT_ID: Final = "02:00:00:00:00:02"
SESSION: Final = 1
SPEED = 0.5  # speed in every command [m/s]
TURN_RATE = 0.1  # turn rate in every command [rad/s]
NOON: Final = "12:00:00.000"  # time stamp that nobody reads: ages are by number
PROGRAM_PRIORITY: Final = 10  # real-time priority, below that of the link
NOT_CONNECTED: Final = 3  # exit code of a program without a connection
OUTLIVES_S: Final = 60.0  # time for which the robot's program outlives the last command
_PICTURE: Final = struct.Struct("q")


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

    def notes(self, side: Side) -> Path:
        """Return the file of the notes of one side."""
        return self.folder / f"{side}.notes"

    def place(self) -> Rendezvous:
        """Return the addresses as a transport takes them."""
        return Rendezvous(self.near, self.far, self.port, self.folder, self.ready_by)


class TeleOpMessages(MessageForm):
    """Commands as the phone's app sends them, whose message id is their number.

    That of a reply counts the robot's replies.
    """

    @override
    def command(self, number: int) -> bytes:
        body = make_set_tele_op(SPEED, TURN_RATE, number)
        return encode(make_message(ROBOT_ID, number, OPERATOR_ID, NOON, SESSION, body))

    @override
    def reply(self, number: int, replies: int) -> bytes:
        reply = Reply(number, OK, "")
        return encode(make_message(OPERATOR_ID, replies, ROBOT_ID, NOON, SESSION, reply))

    @override
    def number_in(self, data: bytes) -> int | None:
        message = decode_if_valid(data)
        if message is None or not isinstance(message.body, SetTeleOp):
            return None
        return message.message_id


TELE_OP: Final = TeleOpMessages()


class ServedEnd(OperatorEnd):
    """The operator's end of a real transport, and time in which it works.

    Args:
        end: End of the transport.
    """

    def __init__(self, end: TransportEnd) -> None:
        self._end = end
        self.clock = ProgramClock(self._serve)

    @override
    def send(self, number: int) -> bool:
        return self._end.send(TELE_OP.command(number))

    def _serve(self, until: float) -> None:
        self._end.serve(until)
        if time.monotonic() < until:  # perhaps it can send again
            self.on_free()


def run_robot(transport: CommandTransport, plan: Plan, notes: FileNotes) -> None:
    """Obey commands and send pictures until killed, or for a minute after the last command."""
    end = transport.far(plan.place(), RobotWorkload(TELE_OP, notes.add).obey)
    clock = ProgramClock(end.serve)
    filling = b"\xff" * (plan.picture_bytes - _PICTURE.size)
    numbers = itertools.count(1)

    def take_picture() -> None:
        number = next(numbers)
        notes.add(NoteKind.PICTURE_TAKEN, number)
        end.send(_PICTURE.pack(number) + filling)

    if plan.picture_hz:
        clock.every(1.0 / plan.picture_hz, take_picture)
    clock.run(plan.until + OUTLIVES_S)


def run_operator(transport: CommandTransport, plan: Plan, notes: FileNotes) -> None:
    """Send a command at every step of a grid, or the newest as soon as one can be sent."""

    def show(picture: bytes) -> None:
        notes.add(NoteKind.PICTURE_SHOWN, _PICTURE.unpack_from(picture)[0])

    end = transport.near(plan.place(), show)
    notes.add(NoteKind.READY, 0)
    served = ServedEnd(end)
    OperatorWorkload(served.clock, served, notes.add, plan.command_hz).start(plan.until)
    served.clock.run(plan.until)
    end.close()


PROGRAMS: Final = {"near": run_operator, "far": run_robot}


def main(side: Side, text: str) -> int:
    """Run one side of a plan; its exit code."""
    plan = Plan.model_validate_json(text)
    transport = load_transport(plan.transport, plan.options)()
    notes = FileNotes(os.open(plan.notes(side), os.O_WRONLY | os.O_CREAT | os.O_TRUNC))
    be_punctual(PROGRAM_PRIORITY)
    gc.disable()  # a pause would look like delay
    try:
        PROGRAMS[side](transport, plan, notes)
    except TransportError as error:
        print(error, file=sys.stderr)
        return NOT_CONNECTED
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))  # type: ignore[arg-type]
