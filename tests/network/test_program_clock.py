"""Real time of programs that are measured."""

import time

from dva_sim.network.realtime import ProgramClock


def test_its_time_is_that_of_the_machine():
    clock = ProgramClock()
    before = time.monotonic()
    clock.run(before + 0.02)
    assert before + 0.02 - 1e-4 <= clock.now <= time.monotonic()


def test_what_is_late_happens_late():
    clock, happened = ProgramClock(), []
    start = clock.now
    clock.call_at(start + 0.001, time.sleep, 0.05)
    clock.call_at(start + 0.002, lambda: happened.append(clock.now))
    clock.run(start + 0.1)
    assert happened[0] >= start + 0.051


def test_between_events_others_have_the_time_until_the_next_one():
    served = []

    def serve(until):
        served.append(until)
        if until > due:
            clock.stop()
        else:
            time.sleep(max(0.0, until - time.monotonic()))

    clock = ProgramClock(serve)
    due = clock.now + 0.02
    clock.call_at(due, lambda: None)
    clock.run(due + 60.0)
    assert abs(served[0] - due) < 1e-5
    assert abs(served[-1] - due - 60.0) < 1e-5
