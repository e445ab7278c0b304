"""Processes that make runs, and what they have to do with the one that started them: nothing."""

import os
import pickle
import signal
import socket
import sys
from functools import partial

import pytest
from helpers.wording import unnamed

from dva_sim.experiments.execution import worker_program
from dva_sim.experiments.execution.executors import LocalProcesses, WorkerDied, WorkerProcess
from dva_sim.kernel.errors import ConfigError


@pytest.fixture
def worker():
    worker = WorkerProcess()
    yield worker
    worker.close()


def test_a_worker_finds_modules_where_its_parent_does_and_ignores_ctrl_c(worker):
    assert worker.call(partial(eval, "__import__('sys').path")) == sys.path
    assert worker.call(partial(eval, "__import__('os').getppid()")) == os.getpid()
    assert not worker.is_stopped
    with LocalProcesses(1) as workers, workers.executor(1, len) as pool:
        pid = pool.submit(os.getpid).result()
        os.kill(pid, signal.SIGINT)
        assert pool.submit(os.getpid).result() == pid


def test_a_worker_whose_parent_has_died_before_its_answer_ends_without_a_word(monkeypatch):
    monkeypatch.setattr(worker_program, "_end_with_parent", lambda _: None)  # it is too late
    ours, theirs = socket.socketpair()
    ours.sendall(pickle.dumps(sys.path) + pickle.dumps(int))
    ours.close()
    worker_program.serve(theirs.detach())


@pytest.mark.parametrize("task", [partial(os._exit, 0), partial(exec, "raise SystemExit")])
def test_a_worker_that_does_not_live_to_answer_is_told_and_another_takes_its_place(task):
    with LocalProcesses(1) as workers, workers.executor(1, len) as pool:
        first = pool.submit(os.getpid).result()
        with pytest.raises(WorkerDied):
            pool.submit(task).result()
        assert pool.submit(os.getpid).result() != first


def test_what_is_defined_in_a_script_is_refused_with_what_to_do(monkeypatch):
    def episode(job):
        return {}

    monkeypatch.setattr(episode, "__module__", "__main__")
    for task in (episode, partial(episode, 1)):
        with (
            pytest.raises(ConfigError) as error,
            LocalProcesses(2) as workers,
            workers.executor(2, task),
        ):
            pass
        assert unnamed(str(error.value), "episode", "module", "jobs=1") == []
