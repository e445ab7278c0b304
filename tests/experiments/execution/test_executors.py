"""Processes of this machine: what they begin with."""

import gc

from dva_sim.experiments.execution.executors import LocalProcesses


def test_workers_look_for_garbage_rarely_and_this_process_as_before():
    before = gc.get_threshold()
    with LocalProcesses(1).executor(1, len) as pool:
        assert pool.submit(gc.get_threshold).result()[0] == 20_000
    assert gc.get_threshold() == before
