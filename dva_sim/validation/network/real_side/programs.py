"""The operator and the robot as real pyzmq programs, and what they note while they run.

The operator connects, the robot binds. A command is 400 bytes whose first eight are its number;
a reply is 200 with the same number. Notes go to memory shared with the parent process:
noting costs about a microsecond, and the notes outlive it, which may be killed at any moment.
Two more programs measure the link itself: they number datagrams and note when these leave and
arrive.
"""

from __future__ import annotations

import math
import mmap
import os
import signal
import socket
import struct
import time
from contextlib import suppress
from enum import IntEnum

import zmq
from zmq.utils.monitor import recv_monitor_message

from dva_sim.network.pattern_runs import COMMAND_BYTES, REPLY_BYTES, Condition

_COUNT = struct.Struct("q")
_NOTE = struct.Struct("iid")


class NoteKind(IntEnum):
    """Kind of a noted event."""

    OPENED = 0
    CONNECTED = 1
    HANDSHAKE = 2
    STARTED = 3
    ISSUED = 4
    REPLIED = 5
    TIMEOUT = 6
    ALERT = 7
    APPLIED = 8


Note = tuple[int, int, float]
"""Kind, number of the command and time [s]."""


class Notes:
    """Made before the program's process is, read after.

    Args:
        room: Notes that find room.
    """

    def __init__(self, room: int) -> None:
        self._room = room
        self._memory = mmap.mmap(-1, _COUNT.size + room * _NOTE.size)
        self._count = 0

    def add(self, kind: NoteKind, number: int, time: float) -> None:
        """Note that something happened.

        Raises:
            MemoryError: there is no room left.
        """
        if self._count == self._room:
            raise MemoryError(f"no room for more than {self._room} notes")
        _NOTE.pack_into(self._memory, _COUNT.size + self._count * _NOTE.size, kind, number, time)
        self._count += 1
        _COUNT.pack_into(self._memory, 0, self._count)

    def read(self) -> list[Note]:
        """All notes so far, in their order."""
        (count,) = _COUNT.unpack_from(self._memory, 0)
        end = _COUNT.size + count * _NOTE.size
        return list(_NOTE.iter_unpack(self._memory[_COUNT.size : end]))


HANDSHAKE_LIMIT_S = 60.0
_NUMBER = struct.Struct("q")
_ENDS = {
    "req-rep": (zmq.REQ, zmq.REP),
    "pub-sub": (zmq.PUB, zmq.SUB),
    "pipelined": (zmq.DEALER, zmq.ROUTER),
}
_now = time.monotonic
Context = zmq.Context[zmq.Socket[bytes]]


def run_robot(condition: Condition, endpoint: str, channel: socket.socket, notes: Notes) -> None:
    """Bind, say where, then obey one command after the other until killed.

    Args:
        endpoint: Address to bind.
        channel: Gets the endpoint when it is bound.
        notes: Gets the end of each command's processing.
    """
    with zmq.Context() as context:
        robot = _open(context, condition, operator=False)
        robot.bind(endpoint)
        channel.send(bytes(robot.getsockopt(zmq.LAST_ENDPOINT)).rstrip(b"\0"))
        while True:
            *sender, payload = robot.recv_multipart()
            _pause_until(_now() + 1e-3 * condition.proc_ms)
            (number,) = _NUMBER.unpack_from(payload)
            notes.add(NoteKind.APPLIED, number, _now())
            if condition.pattern != "pub-sub":
                robot.send_multipart([*sender, _message(number, REPLY_BYTES)])


def run_operator(condition: Condition, channel: socket.socket, notes: Notes) -> None:
    """Wait to hear where the robot is, then send commands until the window ends.

    Args:
        channel: Channel on which the robot's endpoint arrives.
        notes: Gets what happens.

    Raises:
        TimeoutError: the handshake took more than a minute.
        OSError: the kernel used another congestion control than it was told to.
    """
    endpoint = channel.recv(256).decode()
    with zmq.Context() as context:
        operator = SocketOperator(context, condition, endpoint, notes)
        sends = {"req-rep": operator.ask, "pub-sub": operator.publish, "pipelined": operator.deal}
        sends[condition.pattern]()
        operator.socket.close(0)


class SocketOperator:
    """Sends commands in one of three patterns.

    Args:
        context: Context of its sockets.
        endpoint: Endpoint of the robot.
        notes: Gets what happens.
    """

    def __init__(
        self,
        context: Context,
        condition: Condition,
        endpoint: str,
        notes: Notes,
    ) -> None:
        self._context = context
        self._condition = condition
        self._endpoint = endpoint
        self._notes = notes
        self._period = 1 / condition.hz
        self.socket = _open(context, condition, operator=True)
        self._start = self._connect_first()
        self._end = self._start + condition.warm_s + condition.dur_s
        notes.add(NoteKind.STARTED, 0, self._start)

    def ask(self) -> None:
        """REQ: a command, its reply or an alert, then the next."""
        number = 0
        due = self._start
        while due < self._end:
            _pause_until(due)
            issue = self._note(NoteKind.ISSUED, number)
            if not self._exchange(number):
                return
            number += 1
            due = max(_now(), issue + self._period)

    def publish(self) -> None:
        """PUB: commands on a fixed grid."""
        for number, due in enumerate(self._grid()):
            _pause_until(due)
            self._note(NoteKind.ISSUED, number)
            self.socket.send(_message(number, COMMAND_BYTES))

    def deal(self) -> None:
        """DEALER: commands on a fixed grid, replies whenever they come."""
        for number, due in enumerate(self._grid()):
            self._listen_until(due)
            self._note(NoteKind.ISSUED, number)
            with suppress(zmq.Again):  # the pipe is full: this command is skipped, as PUB would
                self.socket.send(_message(number, COMMAND_BYTES), zmq.NOBLOCK)

    def _grid(self) -> list[float]:
        steps = range(int((self._end - self._start) * self._condition.hz + 1))
        dues = (self._start + step * self._period for step in steps)
        return [due for due in dues if due < self._end - 1e-9]

    def _exchange(self, number: int) -> bool:
        """One command with all its attempts; False where the end came before its reply."""
        for _ in range(self._condition.attempts or 1):
            self.socket.send(_message(number, COMMAND_BYTES))
            late = _now() + 1e-3 * (self._condition.timeout_ms or 0.0)
            if self.socket.poll(_milliseconds(min(late, self._end) - _now())):
                self._hear()
                return True
            if late >= self._end:
                return False
            self._note(NoteKind.TIMEOUT, number)
            self.socket.close(0)
            self.socket = _open(self._context, self._condition, operator=True)
            self.socket.connect(self._endpoint)
        self._note(NoteKind.ALERT, number)
        return True

    def _listen_until(self, due: float) -> None:
        """Take replies until a command is due; polling counts whole milliseconds only."""
        while (left := due - _now()) > 0:
            if self.socket.poll(int(1e3 * left)):
                self._hear()

    def _hear(self) -> None:
        (number,) = _NUMBER.unpack_from(self.socket.recv())
        self._note(NoteKind.REPLIED, number)

    def _note(self, kind: NoteKind, number: int) -> float:
        now = _now()
        self._notes.add(kind, number, now)
        return now

    def _connect_first(self) -> float:
        """Connect, wait if that is set; when the first command is due."""
        opened = self._note(NoteKind.OPENED, 0)
        if not self._condition.wait_hs:
            self.socket.connect(self._endpoint)
            return opened
        events = self.socket.get_monitor_socket(zmq.EVENT_CONNECTED | zmq.EVENT_HANDSHAKE_SUCCEEDED)
        self.socket.connect(self._endpoint)
        self._await_handshake(events, opened + HANDSHAKE_LIMIT_S)
        self.socket.disable_monitor()
        due = _now() + self._condition.subscription_wait_s
        _pause_until(due)
        return due

    def _await_handshake(self, events: zmq.Socket[bytes], limit: float) -> None:
        while events.poll(_milliseconds(limit - _now())):
            event = recv_monitor_message(events)
            if event["event"] == zmq.EVENT_CONNECTED:
                self._note(NoteKind.CONNECTED, 0)
                self._check_congestion_control(event["value"])
            else:
                self._note(NoteKind.HANDSHAKE, 0)
                return
        raise TimeoutError(f"there was no handshake within {HANDSHAKE_LIMIT_S:g} s")

    def _check_congestion_control(self, file: int) -> None:
        if self._endpoint.startswith("tcp://127."):
            return  # through the proxy, the kernel's own choice
        with socket.socket(fileno=os.dup(file)) as connection:
            used = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_CONGESTION, 16)
        if used.rstrip(b"\0").decode() != self._condition.cc:
            raise OSError(f"the kernel uses {used!r} instead of {self._condition.cc}")


def _open(context: Context, condition: Condition, operator: bool) -> zmq.Socket[bytes]:
    """A socket of one end, set as the condition says."""
    opened = context.socket(_ENDS[condition.pattern][0 if operator else 1])
    opened.linger = 0
    opened.sndhwm = opened.rcvhwm = condition.hwm
    if condition.conflate in ("both", "op" if operator else "rob"):
        opened.conflate = 1
    if operator and condition.sndbuf is not None:
        opened.sndbuf = condition.sndbuf
    if not operator and condition.rcvbuf is not None:
        opened.rcvbuf = condition.rcvbuf
    if opened.type == zmq.SUB:
        opened.subscribe(b"")
    return opened


def _message(number: int, size: int) -> bytes:
    return _NUMBER.pack(number).ljust(size, b".")


def _milliseconds(left: float) -> int:
    """A time [s] as polling takes it, rounded up."""
    return max(0, math.ceil(1e3 * left))


def _pause_until(due: float) -> None:
    left = due - _now()
    if left > 0:
        time.sleep(left)


HEADERS_BYTES = 28  # of IPv4 and UDP
_PORT = 5556


def run_sender(
    channel: socket.socket,
    notes: Notes,
    address: str,
    count: int,
    size: int,
    interval_s: float,
    linger_s: float,
) -> None:
    """Send datagrams in equal steps, then wait for the last ones to arrive.

    Args:
        channel: Says when the other end listens.
        notes: Gets the time of each sending.
        address: Address of the other end.
        count: Datagrams.
        size: Packet size including headers [B].
        interval_s: Between two of them [s].
        linger_s: Time to wait at the end [s].
    """
    channel.recv(256)
    payload = b"." * (size - HEADERS_BYTES - _NUMBER.size)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect((address, _PORT))
        start = time.monotonic()
        for number in range(count):
            _pause_until(start + number * interval_s)
            notes.add(NoteKind.ISSUED, number, time.monotonic())
            sender.send(_NUMBER.pack(number) + payload)
        time.sleep(linger_s)


def run_counter(channel: socket.socket, notes: Notes, address: str) -> None:
    """Note when each datagram arrives, until killed.

    Args:
        channel: Channel for the message that this end listens.
        notes: Gets the time of each arrival.
        address: Address of this end.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind((address, _PORT))
        channel.send(b"listening")
        while True:
            payload = receiver.recv(65_536)
            now = time.monotonic()
            notes.add(NoteKind.APPLIED, _NUMBER.unpack_from(payload)[0], now)


def begin_nothing(channel: socket.socket, notes: Notes) -> None:
    """Wait for the other end, and be done."""
    channel.recv(256)


def await_nothing(channel: socket.socket, notes: Notes) -> None:
    """Say that this end is there, and wait to be killed."""
    channel.send(b"tcp://127.0.0.1:9")  # a relay wants an address; nobody connects
    signal.pause()
