"""Measures of a run recomputed from its journal, though the run forgets its reports."""

import json

import pytest

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import Recorder
from dva_sim.simulation.full.run import Run, Watched
from dva_sim.simulation.full.run_journal import RunJournal, compute_recording
from dva_sim.simulation.measures.drives import command_rows, drive_rows
from dva_sim.simulation.measures.episodes import tables_of
from dva_sim.simulation.scenario import build, load

KEPT = 5  # entries of each list of a drive that are not forgotten


def plain(tables):
    """Tables as text, so that what is missing is equal to what is missing."""
    return json.dumps(tables, sort_keys=True)


def journaled(scenario, seed, until):
    """The lines of a run that forgets each second what it has told."""
    run = Run(scenario, seed, watched=Watched(Clock(), Recorder()))
    journal, lines = RunJournal(run, lambda tag: run.stage.labels.get(tag, tag)), []
    for second in range(1, until + 1):
        run.clock.run(second)
        if second == until:
            run.recording()
        lines += journal.lines()
        for drive in run.recorder.drives:
            for grown in (drive.frames, drive.commands, drive.applied, drive.intents):
                del grown[:-KEPT]
        journal.forget()
    return lines


@pytest.mark.parametrize(
    ("name", "until", "changes"),
    [
        ("drive-to-event", 30, {}),
        ("fire-drill", 90, {"dispatch.person": {}, "dispatch.policy": "coverage"}),
        ("drive-to-event", 25, {"disturbance.kind": "revoke", "disturbance.after_s": 5.0}),
    ],
)
def test_tables_from_the_journal_are_those_of_the_run(name, until, changes):
    scenario = build(load(name), changes)
    whole = Run(scenario, 3, watched=Watched(Clock(), Recorder()))
    whole.clock.run(until)
    expected = whole.recording()
    found = compute_recording(scenario, 3, journaled(scenario, 3, until))
    assert plain(tables_of(found)) == plain(tables_of(expected))
    for rows in (drive_rows, command_rows):
        assert plain(rows(found)) == plain(rows(expected))
    assert expected.recorder.drives


def test_what_has_not_changed_is_not_told_again():
    run = Run(build(load("drive-to-event"), {}), 1, watched=Watched(Clock(), Recorder()))
    journal = RunJournal(run, lambda tag: tag)
    run.clock.run(5.0)
    assert journal.lines()
    assert journal.lines() == []
