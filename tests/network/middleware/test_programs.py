"""Both programs: what the robot obeys and notes, what the operator sends when it may."""

import subprocess
import sys
import time

import pytest
from helpers.network.free_ports import free_port

from dva_sim.network.middleware import CommandTransport, TransportEnd
from dva_sim.network.middleware.programs import (
    NOT_CONNECTED,
    OperatorProgram,
    Plan,
    ProgramNoteKind,
    ProgramNotes,
    RobotProgram,
    command,
)
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


def kinds(path):
    return [(note.kind, note.number) for note in ProgramNotes.read(path)]


def test_the_robot_obeys_what_is_newer_and_notes_what_is_not(tmp_path):
    transport, path = Scripted(), tmp_path / "notes"
    RobotProgram(transport, plan(tmp_path), ProgramNotes(path))
    heartbeat = encode(
        make_message("02:00:00:00:00:02", 9, "02:00:00:00:00:01", "12:00:00", None, Heartbeat())
    )
    replies = [
        transport.deliver(data)
        for data in (command(1), command(3), command(2), command(3), b"<", heartbeat, command(4))
    ]
    assert kinds(path) == [
        (ProgramNoteKind.APPLIED, 1),
        (ProgramNoteKind.APPLIED, 3),
        (ProgramNoteKind.OUTDATED, 2),
        (ProgramNoteKind.OUTDATED, 3),
        (ProgramNoteKind.UNREADABLE, 0),
        (ProgramNoteKind.UNREADABLE, 9),
        (ProgramNoteKind.APPLIED, 4),
    ]
    answered = [decode(reply).body for reply in replies if reply is not None]
    assert [(reply.answers, reply.code) for reply in answered] == [
        (number, OK) for number in (1, 3, 2, 3, 4)
    ]


def test_what_is_not_taken_is_offered_again_as_a_newer_command(tmp_path):
    transport, path = Scripted(takes=lambda count: count % 3 == 0), tmp_path / "notes"
    OperatorProgram(transport, plan(tmp_path), ProgramNotes(path)).run()
    assert [decode(data).message_id for data in transport.sent] == list(
        range(1, len(transport.sent) + 1)
    )
    noted = kinds(path)
    assert noted[0] == (ProgramNoteKind.READY, 0)
    assert [kind for kind, number in noted if number == 1] == [
        *(ProgramNoteKind.SENT, ProgramNoteKind.REFUSED) * 2,
        ProgramNoteKind.SENT,
    ]


@pytest.mark.parametrize("hz", [50.0, 0.0])
def test_the_robot_sends_pictures_of_the_planned_size_if_there_are_to_be_any(tmp_path, hz):
    transport, path = Scripted(), tmp_path / "notes"
    ends = plan(tmp_path, until=time.monotonic() - 59.7, picture_hz=hz, picture_bytes=1_000)
    RobotProgram(transport, ends, ProgramNotes(path)).run()
    assert {len(picture) for picture in transport.sent} == ({1_000} if hz else set())
    assert kinds(path) == [
        (ProgramNoteKind.PICTURE_TAKEN, number) for number in range(1, len(transport.sent) + 1)
    ]


def test_notes_of_a_killed_program_are_read_as_far_as_they_are_whole(tmp_path):
    notes = ProgramNotes(tmp_path / "notes")
    for number in range(3):
        notes.add(ProgramNoteKind.SENT, number)
    whole = (tmp_path / "notes").read_bytes()
    (tmp_path / "notes").write_bytes(whole[:-5])
    assert [note.number for note in ProgramNotes.read(tmp_path / "notes")] == [0, 1]


@pytest.mark.system
def test_an_operator_whom_nobody_answers_says_so_and_ends(tmp_path):
    reported = plan(tmp_path, ready_by=time.monotonic() + 0.2, port=free_port())
    words = [sys.executable, "-m", "dva_sim.network.middleware.programs"]
    ended = subprocess.run(
        [*words, "near", reported.model_dump_json()], capture_output=True, text=True, timeout=60
    )
    assert ended.returncode == NOT_CONNECTED
    assert len(ended.stderr.splitlines()) == 1
    assert [note.kind for note in ProgramNotes.read(tmp_path / "near.notes")] == []
