"""A mistake is blamed on the word that is wrong, and its hint leads there."""

import errno
import os
import resource
import socket
import subprocess
import sys
from contextlib import closing

import pytest
from helpers.paths import PYTHON_PATH
from helpers.processes.command_line import call
from helpers.wording import unnamed

from dva_sim.experiments.execution import executors
from dva_sim.experiments.study.loading import load_study
from dva_sim.kernel.errors import DvaSimError
from dva_sim.live import open_files


@pytest.mark.parametrize("words", [["console", "--no-open"], ["robot", "--no-open"]])
def test_a_port_in_use_names_the_way_out(words):
    with closing(socket.create_server(("127.0.0.1", 0))) as other:
        port = str(other.getsockname()[1])
        ended = call(*words, "--port", port)
    assert ended.returncode == 2
    assert unnamed(ended.stderr, port, "--port 0") == []


@pytest.mark.system
@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252"])
def test_signs_that_a_terminal_lacks_are_shown_as_plain_ones(tmp_path, encoding):
    shown = "import dva_sim.cli.plain_output as o; "
    shown += (
        "o.replace_what_cannot_be_shown(); print('9.3\u2013120\u00a0s \u2026 \u4e16 caf\u00e9')"
    )
    environment = os.environ | {"PYTHONIOENCODING": encoding, "PYTHONPATH": PYTHON_PATH}
    done = subprocess.run([sys.executable, "-c", shown], env=environment, capture_output=True)
    assert done.returncode == 0, done.stderr
    output = done.stdout.decode(encoding)
    wanted = {"ascii": "9.3-120 s ... ? cafe", "latin-1": "9.3-120\u00a0s ... ? caf\u00e9"}
    assert output.strip() == wanted.get(encoding, "9.3\u2013120\u00a0s \u2026 ? caf\u00e9")


def test_too_few_open_files_are_told_with_how_many_it_takes(monkeypatch):
    monkeypatch.setattr(open_files, "_usable", lambda: 64)
    assert open_files.room_here().devices == 1
    with pytest.raises(DvaSimError) as error:
        open_files.check_room_for(6)
    assert unnamed(str(error.value), "64 files", "6 devices", "ulimit -n") == []
    monkeypatch.undo()
    assert resource.getrlimit(resource.RLIMIT_NOFILE)[0] > 0
    open_files.check_room_for(1)


def test_a_process_that_cannot_be_started_is_told_with_the_way_around(monkeypatch):
    def refuse(*_, **__):
        raise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    monkeypatch.setattr(subprocess.Popen, "__init__", refuse)
    with (
        pytest.raises(DvaSimError) as error,
        executors.LocalProcesses(2) as workers,
        workers.executor(2, load_study) as pool,
    ):
        pool.submit(load_study).result()
    assert unnamed(str(error.value), "Resource temporarily unavailable", "--jobs") == []
