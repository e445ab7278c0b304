"""The operator's and the robot's programs over a scripted carrier, and notes of real ones."""

import os
import sys

import pytest
from helpers.processes import patience

from dva_sim.kernel.clock import Clock
from dva_sim.network.workload import (
    FileNotes,
    Note,
    NoteKind,
    NumberedBytes,
    OperatorEnd,
    OperatorWorkload,
    RobotWorkload,
)

A_PROCESS_NOTES_AND_IS_KILLED = """
import os, signal
from dva_sim.network.workload import FileNotes, NoteKind
notes = FileNotes(1)
notes.add(NoteKind.SENT, 1, 1.5)
notes.add(NoteKind.APPLIED, 3, 2.25)
os.kill(os.getpid(), signal.SIGKILL)
"""


class ScriptedEnd(OperatorEnd):
    """Takes a command if a test says so."""

    def __init__(self):
        self.takes = True

    def send(self, number):
        return self.takes


class Drive:
    """An operator's program in virtual time: four commands a second for two seconds."""

    def __init__(self, in_step=False):
        self.clock, self.end, self.notes = Clock(), ScriptedEnd(), []
        self.operator = OperatorWorkload(self.clock, self.end, self.note, 4.0, in_step)
        self.operator.start(2.0)

    def note(self, kind, number, at=None):
        self.notes.append((kind, number, self.clock.now))

    def times(self, kind):
        return [(number, at) for noted, number, at in self.notes if noted is kind]

    def reply(self, number):
        self.end.on_reply(number)
        self.end.on_free()


@pytest.fixture
def drive():
    return Drive()


def test_commands_go_at_every_step_of_a_grid_and_the_last_one_ends_the_program(drive):
    drive.clock.run(5.0)
    assert drive.times(NoteKind.SENT) == [(k + 1, 0.25 * k) for k in range(8)]
    assert drive.operator.ended == 1.75


def test_a_refused_command_goes_as_the_newest_one_as_soon_as_it_can(drive):
    drive.end.takes = False
    drive.clock.call_at(0.6, drive.end.on_free)
    drive.clock.call_at(0.7, setattr, drive.end, "takes", True)
    drive.clock.call_at(0.7, drive.end.on_free)
    drive.clock.run(0.9)
    assert drive.times(NoteKind.REFUSED) == [(2, 0.25), (2, 0.5), (2, 0.6)]
    assert drive.times(NoteKind.SENT)[-2:] == [(2, 0.7), (3, 0.75)]


def test_what_is_refused_last_may_still_go_until_the_end(drive):
    drive.clock.run(1.6)
    drive.end.takes = False
    drive.clock.run(1.9)
    assert drive.operator.ended is None
    drive.end.takes = True
    drive.end.on_free()
    assert drive.times(NoteKind.SENT)[-1] == (8, 1.9)
    drive.clock.run(5.0)
    assert drive.operator.ended == 2.0


def test_in_step_the_next_command_waits_for_the_answer_and_a_period():
    drive = Drive(in_step=True)
    drive.clock.call_at(0.1, drive.reply, 1)
    drive.clock.call_at(0.9, drive.reply, 2)
    drive.clock.run(5.0)
    assert drive.times(NoteKind.SENT) == [(1, 0.0), (2, 0.25), (3, 0.9)]
    assert drive.times(NoteKind.REPLIED) == [(1, 0.1), (2, 0.9)]
    assert drive.operator.ended == 2.0


def test_steps_that_are_missed_while_a_carrier_is_busy_are_left_out(drive, monkeypatch):
    def send(number):
        if number == 2:
            drive.clock.run(1.1)
        return True

    monkeypatch.setattr(drive.end, "send", send)
    drive.clock.run(1.6)
    assert drive.times(NoteKind.SENT) == [(1, 0.0), (2, 0.25), (3, 1.25), (4, 1.5)]


def test_the_robot_counts_its_replies():
    noted = []
    robot = RobotWorkload(NumberedBytes(20, 10), lambda *note: noted.append(note))
    command = NumberedBytes(20, 10).command(7)
    assert robot.obey(command) == (7).to_bytes(8, "little") + b".."
    assert noted == [(NoteKind.APPLIED, 7)]


def test_notes_of_a_killed_program_are_read_as_far_as_they_are_whole():
    ended = patience.run(
        [sys.executable, "-c", A_PROCESS_NOTES_AND_IS_KILLED], capture_output=True, check=False
    )
    assert ended.returncode < 0
    first, second = Note(NoteKind.SENT, 1, 1.5), Note(NoteKind.APPLIED, 3, 2.25)
    assert FileNotes.read(ended.stdout) == [first, second]
    assert FileNotes.read(ended.stdout[:-5]) == [first]


def test_a_note_without_a_time_has_that_of_now(tmp_path):
    file = os.open(tmp_path / "notes", os.O_RDWR | os.O_CREAT)
    FileNotes(file).add(NoteKind.SENT, 1)
    [note] = FileNotes.read(os.pread(file, 100, 0))
    os.close(file)
    assert note.time > 0.0
