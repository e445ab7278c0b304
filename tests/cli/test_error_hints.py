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
from dva_sim.experiments.study.cell_grid import cells
from dva_sim.experiments.study.loading import load_study, write_study
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.live import open_files


@pytest.fixture
def study(tmp_path):
    """Writes the template of a study with one text in place of another."""

    def write(old, new):
        path = write_study(str(tmp_path / "mine"))
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))
        return path

    return write


PATTERNS = "pattern: [req-rep, latest-wins]"


@pytest.mark.parametrize(
    ("old", "new", "line_of", "meant"),
    [
        (PATTERNS, "pattern: [req-repp, latest-wins]", "factors", "'req-rep'"),
        (PATTERNS, "pattern: [req-rep, latest-win]", "factors", "'latest-wins'"),
        (PATTERNS, "patern: [req-rep, latest-wins]", "factors", "'pattern'"),
        ("link.delay_s: [0, 0.5]", "link.dely_s: [0, 0.5]", "factors", "'delay_s'"),
        ("contrast: [req-rep", "contrast: [req-repp", "answer", "'req-rep'"),
        ("factor: pattern", "factor: patern", "answer", "'pattern'"),
        ("measure: drive_time_s", "measure: drive_times_s", "answer", "'drive_time_s'"),
    ],
)
def test_a_misspelt_word_of_a_study_is_the_one_that_is_blamed(study, old, new, line_of, meant):
    path = study(old, new)
    with pytest.raises(ConfigError) as error:
        cells(load_study(path))
    assert unnamed(error.value.problem, meant) == []
    block = next(n for n, text in enumerate(path.read_text().splitlines(), 1)
                 if text.startswith(f"{line_of}:"))  # fmt: skip
    assert block < error.value.line < block + 10


@pytest.mark.parametrize("words", [["console", "--no-open"], ["robot", "--no-open"]])
def test_a_port_in_use_names_the_way_out(words):
    with closing(socket.create_server(("127.0.0.1", 0))) as other:
        port = str(other.getsockname()[1])
        ended = call(*words, "--port", port)
    assert ended.returncode == 2
    assert unnamed(ended.stderr, port, "--port 0") == []


@pytest.mark.parametrize(
    ("text", "line", "names"),
    [
        ("a: 1\nb: [1, 2\n", 2, ["]"]),
        ("a: {b: 1\nc: 2\n", 1, ["}"]),
        ('a: 1\nb: "open\nc: 2\n', 2, ["quote"]),
        ("a: 1\n b: 2\n", 2, ["colon"]),
        ("a:\n\tb: 1\n", 2, ["tab", "spaces"]),
        ("a: 1\na: 2\n", 2, ["'a'", "twice"]),
        ("a: *x\n", 1, ["*x"]),
        ("a: @x\n", 1, ["@", "quotes"]),
        ("a: 1\nb\nc: 2\n", 2, ["colon"]),
        ('a: "\\q"\n', 1, ["\\q", "single"]),
        ("a:\n  - 1\n - 2\n", 3, ["indented"]),
        ("a: 1\n---\nb: 1\n", 2, ["document"]),
    ],
)
def test_a_mistake_in_yaml_is_told_at_the_line_that_is_wrong(tmp_path, text, line, names):
    file = tmp_path / "x.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError) as error:
        load_yaml(file)
    assert error.value.line == line
    assert unnamed(error.value.problem, *names) == []
    assert not any(word in error.value.problem for word in ("<", "token", "stream", "scalar"))


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
    assert open_files.devices_that_fit() == 1
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
