"""Programs of an operator and a robot: messages sent, obeyed and recorded.

They are the same on every carrier: the virtual network, ZeroMQ sockets, real middleware and models
of it. A carrier gives the operator an `OperatorEnd`; one that transports messages has those below,
whose requests go by the `Requester` of every run. Commands have numbers from 1 on. Time is that of
a clock, virtual or real.
"""

from __future__ import annotations

import itertools
import os
import struct
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from enum import IntEnum
from functools import partial
from typing import Final, NamedTuple, Protocol

from typing_extensions import override

from dva_sim.kernel.clock import Clock
from dva_sim.network.messaging import CommandSockets, Requester, RequestTransport

OPERATOR: Final = "operator"
ROBOT: Final = "robot"
UNBOUNDED: Final = 1 << 30  # a queue, buffer, number of attempts or time [s] that nothing fills
_JUST_BEFORE_S: Final = 1e-9  # a step this close to the end counts as the end [s]


class NoteKind(IntEnum):
    """Kind of a note."""

    OPENED = 0  # the first socket
    CONNECTED = 1
    READY = 2  # the connection stands
    STARTED = 3
    SENT = 4
    REFUSED = 5  # the carrier took nothing: an answer was due, or a queue was full
    REPLIED = 6
    TIMEOUT = 7
    ALERT = 8  # no answer after the last attempt
    APPLIED = 9
    UNREADABLE = 10
    PICTURE_TAKEN = 11
    PICTURE_SHOWN = 12


class Note(NamedTuple):
    """Event of a command or picture, and its time [s]."""

    kind: NoteKind
    number: int
    time: float


class NoteTaker(Protocol):
    """Adds notes."""

    def __call__(self, kind: NoteKind, number: int, at: float | None = None) -> object:
        """Note what happens to the command or picture of a number, now or at a time [s]."""


class FileNotes:
    """Notes in a file, which outlive a program that is killed; may be added to by several threads.

    Args:
        file: Descriptor of the file.
    """

    _ROW: Final = struct.Struct("iqd")

    def __init__(self, file: int) -> None:
        self._file = file

    def add(self, kind: NoteKind, number: int, at: float | None = None) -> None:
        """Note what happens, now or at a time of `time.monotonic` [s]."""
        os.write(self._file, self._ROW.pack(kind, number, at or time.monotonic()))

    @staticmethod
    def read(data: bytes) -> list[Note]:
        """Return all whole notes of a file, in their order.

        Args:
            data: Content of the file.
        """
        row = FileNotes._ROW
        whole = data[: len(data) // row.size * row.size]
        return [Note(NoteKind(kind), number, at) for kind, number, at in row.iter_unpack(whole)]


class MessageForm(Protocol):
    """Bytes of commands and replies."""

    def command(self, number: int) -> bytes:
        """Return the bytes of a command."""

    def reply(self, number: int, replies: int) -> bytes:
        """Return the bytes of the robot's reply to a command, the so-many-th that it makes."""

    def number_in(self, data: bytes) -> int | None:
        """Return the number of a command; None if it cannot be read."""


class NumberedBytes(MessageForm):
    """Messages that begin with their number.

    Args:
        command_bytes: Size of a command [B].
        reply_bytes: Size of a reply [B].
    """

    def __init__(self, command_bytes: int, reply_bytes: int) -> None:
        self._command_bytes = command_bytes
        self._reply_bytes = reply_bytes

    @override
    def command(self, number: int) -> bytes:
        return number.to_bytes(8, "little").ljust(self._command_bytes, b".")

    @override
    def reply(self, number: int, replies: int) -> bytes:
        return number.to_bytes(8, "little").ljust(self._reply_bytes, b".")

    @override
    def number_in(self, data: bytes) -> int:
        return int.from_bytes(data[:8], "little")


def _nothing(*_: object) -> None:
    return None


class OperatorEnd(ABC):
    """The operator's end of a carrier.

    Attributes:
        on_reply: Callback for the number of each command that was answered.
        on_timeout: Callback for each attempt, by the number of its command, without an answer.
        on_failure: Callback for the number of each command that was given up.
        on_free: Callback when a command can be sent after one was refused or answered.
    """

    on_reply: Callable[[int], object] = staticmethod(_nothing)
    on_timeout: Callable[[int], object] = staticmethod(_nothing)
    on_failure: Callable[[int], object] = staticmethod(_nothing)
    on_free: Callable[[], object] = staticmethod(_nothing)

    @abstractmethod
    def send(self, number: int) -> bool:
        """Hand over a command; False if nothing is taken now."""


class RequestEnd(OperatorEnd):
    """Sends commands as requests; a window above 1 lets several be unanswered at a time.

    Args:
        transport: Carries the messages.
        form: Their bytes.
        timeout: Time to wait for a reply [s].
        attempts: Number of times a command is sent before it is given up.
        window: Maximum number of unanswered commands.
    """

    def __init__(
        self,
        transport: RequestTransport,
        form: MessageForm,
        *,
        timeout: float = UNBOUNDED,
        attempts: int = 1,
        window: int = 1,
    ) -> None:
        self._form = form
        self._requester = Requester(transport, OPERATOR, ROBOT, timeout, attempts, window=window)
        self._requester.on_timeout = lambda: self.on_timeout(self._number)
        self._number = 0
        self._requester.open()

    @override
    def send(self, number: int) -> bool:
        if self._requester.busy:
            return False
        self._number = number
        data = self._form.command(number)

        def replied(_: bytes) -> None:
            self.on_reply(number)
            self.on_free()

        def failed() -> None:
            self.on_failure(number)
            self.on_free()

        self._requester.request(data, replied, failed)
        return True


class PublishEnd(OperatorEnd):
    """Publishes commands, without a topic.

    Args:
        transport: Carries the messages.
        form: Their bytes.
    """

    def __init__(self, transport: CommandSockets, form: MessageForm) -> None:
        self._transport = transport
        self._form = form

    @override
    def send(self, number: int) -> bool:
        data = self._form.command(number)
        self._transport.publish(OPERATOR, "", data, len(data))
        return True


class OperatorWorkload:
    """Sends commands on a grid, or each in step with the answer to the one before.

    A command that the carrier refuses is offered again, as the newest one, as soon as it can be
    taken. Steps of the grid that a busy machine has missed are left out.

    Args:
        clock: Virtual or real time.
        end: Takes the commands.
        note: Adds notes.
        hz: Commands per second.
        in_step: True if a command goes at the later of the answer to the last one, or its failure,
            and a period after its sending.

    Attributes:
        ended: Time from which nothing more is sent [s]; None while the program runs.
        on_end: Callback at that time.
    """

    def __init__(
        self, clock: Clock, end: OperatorEnd, note: NoteTaker, hz: float, in_step: bool = False
    ) -> None:
        self._clock = clock
        self._end = end
        self._note = note
        self._period = 1.0 / hz
        self._in_step = in_step
        self._start = self._until = self._issued = 0.0
        self._steps = self._sent = 0
        self._waits = False
        self.ended: float | None = None
        self.on_end: Callable[[], object] = _nothing
        end.on_reply = partial(note, NoteKind.REPLIED)
        end.on_timeout = partial(note, NoteKind.TIMEOUT)
        end.on_failure = partial(note, NoteKind.ALERT)
        end.on_free = self._freed

    def start(self, until: float) -> None:
        """Begin: the first command is due now, and none from a time on [s]."""
        self._start = self._clock.now
        self._until = until
        self._note(NoteKind.STARTED, 0, self._start)
        self._clock.call_at(until, self._stop)
        self._step()

    def _step(self) -> None:
        if self.ended is None:
            self._offer()
            if not self._in_step:
                self._schedule(self._next_step())

    def _next_step(self) -> float:
        """Return the time of the first step of the grid that is not past [s]."""
        self._steps += 1
        while (due := self._start + self._steps * self._period) < self._clock.now:
            self._steps += 1
        return due

    def _schedule(self, due: float) -> None:
        """Take the next step then [s], or end now if that is too late and nothing waits."""
        if due < self._until - _JUST_BEFORE_S:
            self._clock.call_at(due, self._step)
        elif not self._waits:
            self._stop()

    def _offer(self) -> None:
        number = self._sent + 1
        self._issued = self._clock.now
        self._note(NoteKind.SENT, number)
        is_taken = self._end.send(number)
        self._sent += is_taken
        self._waits = not is_taken
        if self._waits:
            self._note(NoteKind.REFUSED, number)

    def _freed(self) -> None:
        if self.ended is not None:
            return
        if self._in_step:
            self._schedule(max(self._clock.now, self._issued + self._period))
        elif self._waits:
            self._offer()

    def _stop(self) -> None:
        if self.ended is None:
            self.ended = self._clock.now
            self.on_end()


class RobotWorkload:
    """Obeys commands and replies to them; what comes may be told by several threads.

    Args:
        form: Bytes of the messages.
        note: Adds notes.
    """

    def __init__(self, form: MessageForm, note: NoteTaker) -> None:
        self._form = form
        self._note = note
        self._replies = itertools.count(1)

    def obey(self, data: bytes) -> bytes | None:
        """Note a command whose processing is over, and return the reply; None if it is none."""
        number = self._form.number_in(data)
        if number is None:
            self._note(NoteKind.UNREADABLE, 0)
            return None
        self._note(NoteKind.APPLIED, number)
        return self._form.reply(number, next(self._replies))
