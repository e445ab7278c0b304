"""Virtual time at the pace of the wall clock: faster, halted, behind."""

import os
import time
from itertools import pairwise

import pytest

from dva_sim.network import realtime
from dva_sim.network.realtime import MAX_BEHIND, LiveClock, PacedClock

pytestmark = pytest.mark.system

SOON = 20.0  # no test waits longer for what should come at once [s]


def passed(clock, until):
    """Real time until virtual time reaches a value [s]."""
    begun = time.monotonic()
    clock.run(until)
    return time.monotonic() - begun


def test_time_goes_by_as_on_the_wall():
    clock = PacedClock()
    assert passed(clock, clock.now + 0.3) >= 0.29


def test_a_clock_that_begins_is_not_late():
    clock = PacedClock()
    clock.go()
    assert clock.worst_lag() == 0.0


def test_twenty_times_as_fast_as_on_the_wall():
    clock = PacedClock(20.0)
    happened = []
    clock.every(0.5, lambda: happened.append(clock.now))
    took = passed(clock, 10.0)
    assert 0.45 <= took < SOON
    apart = [later - earlier for earlier, later in pairwise(happened)]
    assert apart == [pytest.approx(0.5)] * len(apart)
    assert len(apart) >= 18


def test_a_changed_pace_changes_nothing_about_what_has_gone_by():
    clock = PacedClock()
    clock.run(0.1)
    before = clock.now
    clock.pace(factor=10.0)
    assert before <= clock.now
    assert passed(clock, before + 3.0) >= 0.28


def test_halted_time_stands_while_pulses_go_on_and_goes_on_from_where_it_was():
    clock, beats, happened = PacedClock(), [], []
    clock.call_at(0.05, happened.append, "before")
    clock.call_at(0.2, happened.append, "after")

    def beat():
        beats.append(clock.now)
        if len(beats) == 8:
            clock.pace(paused=True)
        if len(beats) == 30:
            clock.stop()

    clock.pulse(0.01, beat)
    clock.run()
    assert len(set(beats[9:])) == 1
    stood = clock.now
    assert stood < 0.2 or happened == ["before", "after"]
    clock.pace(paused=False)
    assert clock.now == pytest.approx(stood, abs=0.02)
    clock.run(stood + 0.3)
    assert happened == ["before", "after"]


def test_a_callback_that_takes_long_is_told_of_before_what_is_late_because_of_it():
    clock, reports = PacedClock(), []
    clock.on_late = lambda behind: reports.append((behind, list(happened)))
    happened = []
    clock.call_at(0.05, time.sleep, 0.4)
    clock.call_at(0.1, happened.append, "late")
    clock.run(0.6)
    behind, before = max(reports)
    assert behind >= 0.3
    assert before == []
    assert happened == ["late"]
    assert clock.worst_lag() >= 0.3
    assert clock.worst_lag() == 0.0
    assert clock.given_up == 0.0


def test_what_cannot_be_made_up_for_is_given_up_and_nothing_is_left_out():
    clock, happened = PacedClock(), []
    clock.call_at(0.01, time.sleep, MAX_BEHIND + 0.5)
    clock.every(0.1, lambda: happened.append(round(clock.now, 3)))
    took = passed(clock, 2.0)
    assert clock.given_up > 0.3
    assert took > 2.3
    apart = [later - earlier for earlier, later in pairwise(happened)]
    assert apart == [pytest.approx(0.1, abs=0.002)] * len(apart)
    assert len(apart) >= 18


def test_pulses_that_were_missed_are_left_out():
    clock, beats = PacedClock(), []
    clock.call_at(0.05, time.sleep, 0.5)
    clock.pulse(0.01, lambda: beats.append(time.monotonic()))
    clock.run(0.6)
    assert len(beats) < 50


def test_messages_are_heard_while_time_stands():
    clock = PacedClock()
    reads, writes = os.pipe()
    heard = []

    def hear():
        heard.append(os.read(reads, 10))
        clock.stop()

    clock.watch(reads, hear)
    clock.pace(paused=True)
    clock.pulse(0.05, lambda: heard or os.write(writes, b"x"))
    clock.run()
    assert heard == [b"x"]
    os.close(reads)
    os.close(writes)


def test_who_has_nothing_to_do_waits_for_the_next_pulse(monkeypatch):
    polls, poll = [], realtime.Poller.poll
    monkeypatch.setattr(realtime.Poller, "poll", lambda *of: polls.append(of) or poll(*of))
    clock = PacedClock()
    clock.pace(paused=True)
    clock.pulse(0.05, lambda: None)
    end = time.monotonic() + 1.0
    clock.pulse(0.1, lambda: clock.stop() if time.monotonic() > end else None)
    clock.run()
    assert len(polls) < 60  # 20 pulses and 10


@pytest.mark.parametrize("kind", [LiveClock, PacedClock])
def test_that_the_machine_was_suspended_is_told_once_before_anything_is_read(kind, monkeypatch):
    seen, asleep, (ours, theirs) = [], [0.0], os.pipe()
    monkeypatch.setattr(realtime, "slept", lambda: asleep[0])
    clock = kind()
    clock.on_suspended(lambda gap: seen.append(f"slept {gap:g} s"))
    clock.watch(ours, lambda: seen.append(os.read(ours, 10).decode()))
    clock.run(clock.now + 0.01)
    asleep[0] = 20.0
    os.write(theirs, b"old")
    clock.run(clock.now + 0.05)
    clock.unwatch(ours)
    os.close(ours)
    os.close(theirs)
    assert seen == ["slept 20 s", "old"]
