"""A process that was started: ready, crashed, asked to end, and made to."""

import os
import sys
from contextlib import closing

import pytest

from dva_sim.kernel.errors import DvaSimError, ExitCode
from dva_sim.serving import processes
from dva_sim.serving.pipes import PipeEnd
from dva_sim.serving.processes import Child, ChildFailed, end_all

PIPE = -1
UNTIL_INPUT_ENDS = "import sys; print(flush=True); sys.stdin.read()"
UNTIL_SIGTERM = (
    "import signal; signal.signal(signal.SIGTERM, lambda *_: exit(7)); print(flush=True);"
    "signal.pause()"
)
DEAF = (
    "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); print(flush=True);"
    "[signal.pause() for _ in iter(int, 1)]"
)


def started(program: str, **options) -> Child:
    """A process of Python that runs."""
    child = Child("the helper", [sys.executable, "-c", program], stdout=PIPE, **options)
    with child.stdout as said:
        assert said.readline() == b"\n"
    return child


@pytest.mark.parametrize(
    ("program", "options", "code"),
    [(UNTIL_INPUT_ENDS, {"stdin": PIPE}, 0), (UNTIL_SIGTERM, {}, 7)],
    ids=["by the end of its input", "by SIGTERM"],
)
def test_asked_to_end_a_process_ends_by_itself(program, options, code):
    child = started(program, **options)
    end_all([child])
    assert child.returncode == code


def test_a_process_ends_by_its_lifeline():
    cut = []
    child = started(UNTIL_INPUT_ENDS, lifeline=lambda: cut.append(child.stdin.close()), stdin=PIPE)
    end_all([child])
    assert (child.returncode, len(cut)) == (0, 1)


def test_those_that_do_not_end_are_killed_and_those_that_have_ended_are_welcome():
    children = [started(DEAF), started(DEAF), started("print(flush=True)")]
    children[2].wait()
    end_all(children, 0.05)
    assert [child.returncode for child in children] == [-9, -9, 0]


@pytest.mark.parametrize(
    ("program", "why", "kind"),
    [
        ("exit(3)", "exit code 3", ChildFailed),
        ("import os; os.kill(os.getpid(), 9)", "killed by signal 9", ChildFailed),
        ("exit('first\\nerror: the disk is full')", "the disk is full", ChildFailed),
        (
            f"import sys; print('error: no keys', file=sys.stderr); exit({ExitCode.MISTAKE:d})",
            "no keys",
            DvaSimError,
        ),
        ("import sys; sys.stderr.write('x' * 200_000 + '\\nlast'); exit(1)", "last", ChildFailed),
    ],
)
def test_a_process_that_ended_by_itself_says_in_one_line_which_and_why(program, why, kind):
    child = Child("the helper", [sys.executable, "-c", program])
    child.wait()
    failure = child.failure()
    end_all([child])
    assert type(failure) is kind
    assert str(failure) == f"the helper has ended by itself: {why}"


def test_what_a_process_says_first_is_waited_for():
    child = Child("the helper", [sys.executable, "-c", "print('{\"do\": 1}')"], stdout=PIPE)
    with child.stdout, closing(PipeEnd(os.dup(child.stdout.fileno()))) as pipe:
        found = child.ready(lambda: next(iter(pipe.lines()), None))
    end_all([child])
    assert found == {"do": 1}


def test_a_process_that_ends_before_it_is_ready_and_one_that_is_silent_are_told(monkeypatch):
    monkeypatch.setattr(processes, "LOOK", 0.0)
    gone = Child("the helper", [sys.executable, "-c", "exit('no room')"])
    with pytest.raises(ChildFailed, match=r"^the helper has ended by itself: no room$"):
        gone.ready(lambda: None)
    silent = started(DEAF)
    with pytest.raises(ChildFailed, match=r"^the helper said nothing within 0 s$"):
        silent.ready(lambda: None, within=0.0)
    end_all([gone, silent], 0.0)
