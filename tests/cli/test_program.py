"""Command line in this process: options, help and exit codes."""

import shlex
import subprocess
import sys
from itertools import takewhile

import pytest
from typer.main import get_command

from dva_sim import __version__
from dva_sim.cli import app, call, checks
from dva_sim.cli.commands import PanelGroup
from dva_sim.kernel.errors import ConfigError, ExitCode, RunsFailed

COMMANDS = get_command(app).list_commands(None)
GROUPS = ["site"], ["users"]
PATHS = [[name] for name in COMMANDS] + [
    ["site", "show"],
    ["site", "export"],
    *(["users", name] for name in ("add", "change", "remove", "lock", "unlock", "list")),
]
WIDTH = 80


@pytest.fixture
def terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", str(WIDTH))


def test_the_version_is_printed(capsys):
    assert call(["--version"]) == 0
    assert capsys.readouterr().out == f"dva-sim {__version__}\n"


@pytest.mark.parametrize("path", [[], *PATHS], ids=" ".join)
def test_help_by_its_short_name_fits_a_terminal_of_80_columns(terminal, capsys, path):
    assert call([*path, "-h"]) == 0
    short = capsys.readouterr().out
    assert call([*path, "--help"]) == 0
    assert capsys.readouterr().out == short
    assert short.startswith(" ".join(["Usage: dva-sim", *path]))
    assert max(map(len, short.splitlines())) <= WIDTH
    assert "..." not in short.replace("FILE...", "").replace("NAME...", "").replace("[ARGS]...", "")


@pytest.mark.parametrize("path", [path for path in PATHS if path not in GROUPS], ids=" ".join)
def test_help_ends_with_examples_that_say_what_they_do(terminal, capsys, path):
    call([*path, "--help"])
    examples = capsys.readouterr().out.partition("\nExamples:\n")[2].splitlines()
    calls = [line for line in examples if line.startswith("  dva-sim ")]
    remarks = [line for line in examples if line.startswith("  # ")]
    assert calls
    assert len(remarks) == len(calls)
    assert any(line.startswith(f"  dva-sim {' '.join(path)} ") for line in calls) or path == [
        "list"
    ]


@pytest.mark.parametrize("path", [path for path in PATHS if path not in GROUPS], ids=" ".join)
def test_examples_use_words_and_options_that_there_are(path):
    program = get_command(app)
    for line, _ in command_at(path).examples:
        words = list(takewhile(lambda word: word not in "<>", shlex.split(line)[1:]))
        with program.make_context("dva-sim", words) as context:
            _, command, rest = program.resolve_command(context, words)
            while isinstance(command, PanelGroup):
                command, rest = command.get_command(context, rest[0]), rest[1:]
            command.make_context("x", rest, parent=context).close()


def command_at(path):
    command = get_command(app)
    for name in path:
        command = command.get_command(None, name)
    return command


def test_the_help_of_the_program_states_every_exit_code(terminal, capsys):
    call(["--help"])
    output = capsys.readouterr().out.partition("\nExit codes:\n")[2]
    assert [int(line.split()[0]) for line in output.splitlines()] == list(ExitCode)


def test_without_a_command_the_help_is_shown(capsys):
    assert call([]) == 0
    assert capsys.readouterr().out.startswith("Usage: dva-sim")


@pytest.mark.parametrize(
    ("raised", "code", "line"),
    [
        (ConfigError("no\nroom", "a.yaml", 3, 1), 2, "error: a.yaml:3:1: no room"),
        (RunsFailed("3 runs failed"), 3, "error: 3 runs failed"),
        (PermissionError(13, "Permission denied", "a\tb"), 2, "error: a b: Permission denied"),
        (OSError(28, "No space left on device"), 2, "error: No space left on device"),
        (KeyboardInterrupt(), 130, "error: stopped; run the same command again"),
        (KeyboardInterrupt("stopped after 3 of 4 runs"), 130, "error: stopped after 3 of 4 runs"),
        (
            MemoryError(),
            3,
            "error: out of memory; what is finished is kept: free some, then run the command again",
        ),
    ],
)
def test_what_goes_wrong_ends_in_one_line_and_its_code(monkeypatch, capsys, raised, code, line):
    def fail(_):
        raise raised

    monkeypatch.setattr(checks, "print_schema", fail)
    assert call(["schema", "site"]) == code
    assert capsys.readouterr().err == f"{line}\n"


def test_the_program_is_a_module_and_a_reader_that_goes_away_is_no_traceback():
    command = [sys.executable, "-m", "dva_sim", "schema", "message"]
    program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    program.stdout.close()
    assert program.stderr.read() == b""
    assert program.wait() == ExitCode.READER_GONE
    program.stderr.close()
