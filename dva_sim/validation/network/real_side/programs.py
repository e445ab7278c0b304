"""The operator and the robot of a condition as real pyzmq programs, with notes of what they do.

The operator connects, the robot binds. Both send plain frames: a command is 400 bytes whose first
eight are its number, a reply is 200 with the same number. Two more programs measure the link
itself: they number datagrams and note when these leave and arrive.
"""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Callable
from typing import Any, Final

import zmq
from zmq.utils.monitor import recv_monitor_message

from dva_sim.network.messaging import OnReply
from dva_sim.network.middleware.zeromq import PlainWire, plain_socket
from dva_sim.network.pattern_runs import COMMAND_BYTES, REPLY_BYTES, Condition, make_operator
from dva_sim.network.realtime import ProgramClock, Socket
from dva_sim.network.workload import FileNotes, NoteKind, NumberedBytes, RobotWorkload

FORM: Final = NumberedBytes(COMMAND_BYTES, REPLY_BYTES)
HANDSHAKE_LIMIT_S = 60.0
_ENDS = {
    "req-rep": (zmq.REQ, zmq.REP),
    "pub-sub": (zmq.PUB, zmq.SUB),
    "pipelined": (zmq.DEALER, zmq.ROUTER),
}
Context = zmq.Context[Socket]


def run_robot(
    condition: Condition, endpoint: str, channel: socket.socket, notes: FileNotes
) -> None:
    """Bind, say where, then obey one command after the other until killed.

    Args:
        endpoint: Address to bind.
        channel: Gets the endpoint when it is bound.
        notes: Receives the end of each command's processing.
    """
    workload = RobotWorkload(FORM, notes.add)
    with zmq.Context() as context:
        robot = _open(context, condition, operator=False)
        robot.bind(endpoint)
        channel.send(bytes(robot.getsockopt(zmq.LAST_ENDPOINT)).rstrip(b"\0"))
        while True:
            *sender, command = robot.recv_multipart()
            _pause_until(time.monotonic() + 1e-3 * condition.proc_ms)
            reply = workload.obey(command)
            if condition.pattern != "pub-sub" and reply is not None:
                robot.send_multipart([*sender, reply])


def run_operator(condition: Condition, channel: socket.socket, notes: FileNotes) -> None:
    """Wait for the robot's address, then send commands until the window ends.

    Args:
        channel: Channel on which the robot's endpoint arrives.
        notes: Receives all events.

    Raises:
        TimeoutError: the handshake took more than a minute.
        OSError: the kernel used another congestion control than requested.
    """
    endpoint = channel.recv(256).decode()
    with zmq.Context() as context:
        sockets = OperatorSockets(context, condition, endpoint, notes)
        clock = sockets.clock
        operator = make_operator(condition, sockets, FORM, notes.add)
        operator.on_end = clock.stop

        def begin() -> None:
            operator.start(clock.now + condition.warm_s + condition.dur_s)

        def opened() -> None:
            clock.call_after(condition.subscription_wait_s, begin)

        if condition.wait_hs:
            sockets.on_open = opened
        else:
            begin()
        while operator.ended is None:
            clock.run(clock.now + HANDSHAKE_LIMIT_S)
            if not sockets.is_open and condition.wait_hs:
                raise TimeoutError(f"there was no handshake within {HANDSHAKE_LIMIT_S:g} s")
        context.destroy(0)


class OperatorSockets:
    """Plain sockets of the operator; see `CommandSockets`.

    Args:
        context: Context of its sockets.
        endpoint: Endpoint of the robot.
        notes: Receives the opening of the first socket, and the steps of its connection.

    Attributes:
        on_open: Callback when the first connection stands.
        is_open: True from then on.
    """

    def __init__(
        self, context: Context, condition: Condition, endpoint: str, notes: FileNotes
    ) -> None:
        self._context = context
        self._condition = condition
        self._endpoint = endpoint
        self._notes = notes
        self.clock = ProgramClock()
        self.on_open: Callable[[], object] = lambda: None
        self._has_opened = self.is_open = False
        if condition.pattern == "pub-sub":
            self._publisher = self._connected()

    def connect(self, node: str, peer: str, on_reply: OnReply, pipelined: bool) -> PlainWire:
        """Open a connection for requests."""
        return PlainWire(self.clock, self._connected(), on_reply)

    def publish(self, node: str, topic: str, payload: Any, size: int) -> None:
        """Publish a command; PUB drops it without subscribers."""
        self._publisher.send(payload)

    def _connected(self) -> Socket:
        opened = _open(self._context, self._condition, operator=True)
        if not self._has_opened:
            self._has_opened = True
            self._notes.add(NoteKind.OPENED, 0)
            if self._condition.wait_hs:
                self._watch_handshake(opened)
        opened.connect(self._endpoint)
        return opened

    def _watch_handshake(self, opened: Socket) -> None:
        events = opened.get_monitor_socket(zmq.EVENT_CONNECTED | zmq.EVENT_HANDSHAKE_SUCCEEDED)

        def hear() -> None:
            event = recv_monitor_message(events)
            if event["event"] == zmq.EVENT_CONNECTED:
                self._notes.add(NoteKind.CONNECTED, 0)
                self._check_congestion_control(event["value"])
                return
            self._notes.add(NoteKind.READY, 0)
            self.clock.unwatch(events)
            opened.disable_monitor()
            self.is_open = True
            self.on_open()

        self.clock.watch(events, hear)

    def _check_congestion_control(self, file: int) -> None:
        if self._endpoint.startswith("tcp://127."):
            return  # through the proxy, the kernel's own choice
        with socket.socket(fileno=os.dup(file)) as connection:
            used = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_CONGESTION, 16)
        if used.rstrip(b"\0").decode() != self._condition.cc:
            raise OSError(f"the kernel uses {used!r} instead of {self._condition.cc}")


def _open(context: Context, condition: Condition, operator: bool) -> Socket:
    """Return a socket of one end, with the options of the condition."""
    kind = _ENDS[condition.pattern][0 if operator else 1]
    conflates = condition.conflate in ("both", "op" if operator else "rob")
    opened = plain_socket(context, kind, condition.hwm, conflates)
    if operator and condition.sndbuf is not None:
        opened.sndbuf = condition.sndbuf
    if not operator and condition.rcvbuf is not None:
        opened.rcvbuf = condition.rcvbuf
    return opened


def _pause_until(due: float) -> None:
    left = due - time.monotonic()
    if left > 0:
        time.sleep(left)


HEADERS_BYTES = 28  # size of the IPv4 and UDP headers
_PORT = 5556


def run_sender(
    channel: socket.socket,
    notes: FileNotes,
    address: str,
    count: int,
    size: int,
    interval_s: float,
    linger_s: float,
) -> None:
    """Send datagrams in equal steps, then wait for the last ones to arrive.

    Args:
        channel: Channel that tells when the other end listens.
        notes: Receives the time of each sending.
        address: Address of the other end.
        count: Datagrams.
        size: Packet size including headers [B].
        interval_s: Interval between two packets [s].
        linger_s: Time to wait at the end [s].
    """
    channel.recv(256)
    form = NumberedBytes(size - HEADERS_BYTES, 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect((address, _PORT))
        start = time.monotonic()
        for number in range(count):
            _pause_until(start + number * interval_s)
            notes.add(NoteKind.SENT, number)
            sender.send(form.command(number))
        time.sleep(linger_s)


def run_counter(channel: socket.socket, notes: FileNotes, address: str) -> None:
    """Note when each datagram arrives, until killed.

    Args:
        channel: Channel for the message that this end listens.
        notes: Receives the time of each arrival.
        address: Address of this end.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind((address, _PORT))
        channel.send(b"listening")
        while True:
            notes.add(NoteKind.APPLIED, FORM.number_in(receiver.recv(65_536)))


def begin_nothing(channel: socket.socket, notes: FileNotes) -> None:
    """Wait for the other end, and be done."""
    channel.recv(256)


def await_nothing(channel: socket.socket, notes: FileNotes) -> None:
    """Report that this end is ready, and wait to be killed."""
    channel.send(b"tcp://127.0.0.1:9")  # a relay needs an address, although nothing connects
    signal.pause()
