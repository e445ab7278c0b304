"""Both programs: what the robot obeys and notes, what the operator sends when it may."""

import os
import subprocess
import sys
import time

import pytest
from helpers.network.free_ports import free_port

from dva_sim.network.middleware import CommandTransport, TransportEnd
from dva_sim.network.middleware.programs import (
    NOT_CONNECTED,
    TELE_OP,
    Plan,
    run_operator,
    run_robot,
)
from dva_sim.network.workload import FileNotes, NoteKind
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.messages import OK, Heartbeat, make_message


class Scripted(CommandTransport):
    """Takes a command only now and then, and lets a test be the other end."""

    def __init__(self, takes=lambda count: True):
        self.takes, self.sent, self.offered = takes, [], 0

    def near(self, place, receive):
        return self._end(receive)

    def far(self, place, receive):
        return self._end(receive)

    def _end(self, receive):
        self.deliver = receive
        transport = self

        class Ends(TransportEnd):
            def send(self, data):
                transport.offered += 1
                if transport.takes(transport.offered):
                    transport.sent.append(data)
                    return True
                return False

            def close(self):
                pass

        return Ends()


def plan(tmp_path, **changed):
    now = time.monotonic()
    usual = {"ready_by": now, "until": now + 0.5, "transport": "udp", "command_hz": 50.0}
    return Plan(near="127.0.0.1", far="127.0.0.1", folder=tmp_path, **usual | changed)


@pytest.fixture
def notes(tmp_path):
    return FileNotes(os.open(tmp_path / "notes", os.O_RDWR | os.O_CREAT))


def kinds(tmp_path):
    return [(note.kind, note.number) for note in FileNotes.read((tmp_path / "notes").read_bytes())]


def test_the_robot_answers_commands_and_notes_what_it_cannot_read(tmp_path, notes):
    transport = Scripted()
    run_robot(transport, plan(tmp_path, until=time.monotonic() - 60.0), notes)
    heartbeat = encode(
        make_message("02:00:00:00:00:02", 9, "02:00:00:00:00:01", "12:00:00", None, Heartbeat())
    )
    sent = TELE_OP.command(1), TELE_OP.command(3), b"<", heartbeat, TELE_OP.command(2)
    replies = [transport.deliver(data) for data in sent]
    assert kinds(tmp_path) == [
        (NoteKind.APPLIED, 1),
        (NoteKind.APPLIED, 3),
        (NoteKind.UNREADABLE, 0),
        (NoteKind.UNREADABLE, 0),
        (NoteKind.APPLIED, 2),
    ]
    answered = [decode(reply).body for reply in replies if reply is not None]
    assert [(reply.answers, reply.code) for reply in answered] == [(1, OK), (3, OK), (2, OK)]


def test_what_is_not_taken_is_offered_again_as_a_newer_command(tmp_path, notes):
    transport = Scripted(takes=lambda count: count % 3 == 0)
    run_operator(transport, plan(tmp_path), notes)
    assert [decode(data).message_id for data in transport.sent] == list(
        range(1, len(transport.sent) + 1)
    )
    noted = kinds(tmp_path)
    assert noted[:2] == [(NoteKind.READY, 0), (NoteKind.STARTED, 0)]
    assert [kind for kind, number in noted if number == 1] == [
        *(NoteKind.SENT, NoteKind.REFUSED) * 2,
        NoteKind.SENT,
    ]


@pytest.mark.parametrize("hz", [50.0, 0.0])
def test_the_robot_sends_pictures_of_the_planned_size_if_there_are_to_be_any(tmp_path, notes, hz):
    transport = Scripted()
    ends = plan(tmp_path, until=time.monotonic() - 59.7, picture_hz=hz, picture_bytes=1_000)
    run_robot(transport, ends, notes)
    assert {len(picture) for picture in transport.sent} == ({1_000} if hz else set())
    assert kinds(tmp_path) == [
        (NoteKind.PICTURE_TAKEN, number) for number in range(1, len(transport.sent) + 1)
    ]


@pytest.mark.system
def test_an_operator_whom_nobody_answers_says_so_and_ends(tmp_path):
    reported = plan(tmp_path, ready_by=time.monotonic() + 0.2, port=free_port())
    words = [sys.executable, "-m", "dva_sim.network.middleware.programs"]
    ended = subprocess.run(
        [*words, "near", reported.model_dump_json()], capture_output=True, text=True, timeout=60
    )
    assert ended.returncode == NOT_CONNECTED
    assert len(ended.stderr.splitlines()) == 1
    assert (tmp_path / "near.notes").read_bytes() == b""
