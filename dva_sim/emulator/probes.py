"""Programs that measure the link itself: numbered datagrams, noted where they leave and arrive."""

from __future__ import annotations

import signal
import socket
import struct
import time

from dva_sim.emulator.notes import Kind, Notes

HEADERS_BYTES = 28  # of IPv4 and UDP
_PORT = 5556
_NUMBER = struct.Struct("q")


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
        address: Of the other end.
        count: Datagrams.
        size: Of each, with all headers [B].
        interval_s: Between two of them [s].
        linger_s: How long to wait [s].
    """
    channel.recv(256)
    payload = b"." * (size - HEADERS_BYTES - _NUMBER.size)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect((address, _PORT))
        start = time.monotonic()
        for number in range(count):
            left = start + number * interval_s - time.monotonic()
            if left > 0:
                time.sleep(left)
            notes.add(Kind.ISSUED, number, time.monotonic())
            sender.send(_NUMBER.pack(number) + payload)
        time.sleep(linger_s)


def run_counter(channel: socket.socket, notes: Notes, address: str) -> None:
    """Note when each datagram arrives, until killed.

    Args:
        channel: Is told when this end listens.
        notes: Gets the time of each arrival.
        address: Of this end.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind((address, _PORT))
        channel.send(b"listening")
        while True:
            payload = receiver.recv(65_536)
            now = time.monotonic()
            notes.add(Kind.APPLIED, _NUMBER.unpack_from(payload)[0], now)


def begin_nothing(channel: socket.socket, notes: Notes) -> None:
    """Wait for the other end, and be done."""
    channel.recv(256)


def await_nothing(channel: socket.socket, notes: Notes) -> None:
    """Say that this end is there, and wait to be killed."""
    channel.send(b"tcp://127.0.0.1:9")  # a relay wants an address; nobody connects
    signal.pause()
