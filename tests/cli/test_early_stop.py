"""Ctrl-C or SIGTERM ends a command in one line at any moment, also while it is being loaded."""

import signal
import subprocess
import sys

import pytest

from dva_sim.kernel.early_stop import STOPS

STOPPED_AT = """
import os, runpy, signal, sys

class Stop:
    def find_spec(self, name, *_):
        if name == {module!r}:
            os.kill(os.getpid(), {number})

sys.meta_path.insert(0, Stop())
sys.argv = ["dva-sim", *{words!r}]
runpy.run_module("dva_sim", run_name="__main__")
"""
LIVE = ["live", "drive-to-event"]


def stopped_at(
    module: str, words: list[str], number: int, ignored: bool = False
) -> tuple[int, str, str]:
    """Exit code, output and errors of a command that gets a signal while it imports a module."""
    program = STOPPED_AT.format(module=module, words=words, number=int(number))
    ended = subprocess.run(
        [sys.executable, "-c", program],
        preexec_fn=lambda: signal.signal(number, signal.SIG_IGN if ignored else signal.SIG_DFL),
        capture_output=True,
        text=True,
        check=False,
    )
    return ended.returncode, ended.stdout, ended.stderr


@pytest.mark.parametrize(
    ("module", "words"),
    [
        ("dva_sim.cli", ["list"]),
        ("dva_sim.kernel.rare_collection", LIVE),
        pytest.param("dva_sim.live", LIVE, marks=pytest.mark.system),
        pytest.param("zmq", LIVE, marks=pytest.mark.system),
    ],
)
@pytest.mark.parametrize("number", STOPS)
def test_a_command_that_is_stopped_while_it_is_loaded_says_so_in_a_line(module, words, number):
    assert stopped_at(module, words, number) == (
        130,
        "",
        "error: stopped; run the same command again\n",
    )


@pytest.mark.parametrize("number", STOPS)
def test_who_ignores_a_signal_is_not_stopped_by_it(number):
    assert stopped_at("typer", ["--version"], number, ignored=True)[0] == 0
