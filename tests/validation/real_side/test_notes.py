import json
import sys

import pytest
from helpers.processes import patience

from dva_sim.validation.network.real_side.programs import NoteKind, Notes

A_PROCESS_NOTES_AND_ENDS = """
import json, os
from dva_sim.validation.network.real_side.programs import NoteKind, Notes
notes = Notes(10)
if os.fork() == 0:
    notes.add(NoteKind.ISSUED, 0, 1.5)
    notes.add(NoteKind.APPLIED, 3, 2.25)
    os._exit(0)
os.wait()
print(json.dumps(notes.read()))
"""


def test_notes_of_a_process_are_read_after_it_ended():
    ended = patience.run(
        [sys.executable, "-c", A_PROCESS_NOTES_AND_ENDS], capture_output=True, text=True, check=True
    )
    assert json.loads(ended.stdout) == [[4, 0, 1.5], [8, 3, 2.25]]


def test_there_is_no_note_without_room():
    notes = Notes(1)
    notes.add(NoteKind.ALERT, 1, 1.0)
    with pytest.raises(MemoryError, match="more than 1 notes"):
        notes.add(NoteKind.ALERT, 2, 2.0)
    assert notes.read() == [(NoteKind.ALERT, 1, 1.0)]
