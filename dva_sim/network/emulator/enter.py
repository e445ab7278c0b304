"""Runs a program at one end of an emulated link, and ends with all that the program has started.

The program gets a process namespace of its own, whose first process waits for it here. When that
one ends, the kernel kills all others in it, those that have left their session or ignore signals
among them; and it ends with the program, with this process, or with the parent of this process,
whichever is first. Signals for this process go to all processes of the program. Little is imported,
since each program waits for it.
"""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from typing import NoReturn

from dva_sim.network.emulator import linux_calls

KILL_ALL = signal.SIGUSR1
"""Asks for an end of all processes of the program, at once."""

_PASSED_ON = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
_TAKEN = {*_PASSED_ON, KILL_ALL, signal.SIGCHLD}
_NONE = "-"
_BY_SIGNAL = 128  # base of exit codes of programs ended by a signal, as in shells


def words_of(user_space: int | None, network: int, program: list[str]) -> list[str]:
    """Return the command line that runs a program in namespaces, given by their open files."""
    user = _NONE if user_space is None else str(user_space)
    parent = str(os.getpid())
    numbers = [str(os.getuid()), str(os.getgid())]
    # -P: a file of the user that is called like a module of Python is not imported.
    words = [sys.executable, "-P", "-m", __name__, parent, *numbers, user, str(network)]
    return [*words, *program]


def main(parent: int, user: int, group: int, spaces: tuple[str, str], program: list[str]) -> int:
    """Enter the namespaces and run the program; its exit code.

    Args:
        parent: Process that started this one.
        user: Number that the user is called by.
        group: Number that the user's group is called by.
        spaces: Open files of the user namespace, or `-`, and of the network namespace.
        program: Words of the command.
    """
    kinds = (linux_calls.CLONE_NEWUSER, linux_calls.CLONE_NEWNET)
    for space, kind in zip(spaces, kinds, strict=True):
        if space != _NONE:
            linux_calls.join_namespace(int(space), kind)
            os.close(int(space))
    linux_calls.die_with_parent(parent)
    linux_calls.separate_children()
    alive, writing = os.pipe()
    # Taken one by one from here on: none is missed between a look and a wait.
    signal.pthread_sigmask(signal.SIG_BLOCK, _TAKEN)
    first = os.fork()
    if first == 0:
        os.close(writing)
        _wait_for_program(alive, user, group, program)
    while (ended := os.waitpid(first, os.WNOHANG))[0] == 0:
        number = signal.sigwait(_TAKEN)
        if number == KILL_ALL:
            os.kill(first, signal.SIGKILL)
        elif number != signal.SIGCHLD:
            os.kill(first, number)
    return _code_of(ended[1])


def _wait_for_program(alive: int, user: int, group: int, program: list[str]) -> NoReturn:
    """Be the first process of the namespace until the program has ended."""
    code = 1
    try:
        linux_calls.die_with_maker(alive)
        linux_calls.show_own_processes()
        started = os.fork()
        if started == 0:
            _become(program, user, group)
        while (status := _reap(started)) is None:
            number = signal.sigwait(_TAKEN)
            if number in _PASSED_ON:
                with suppress(ProcessLookupError):
                    os.kill(-1, number)  # to every process of this namespace but this one
        code = _code_of(status)
    finally:
        os._exit(code)


def _reap(program: int) -> int | None:
    """Take leave of all processes that have ended; the status of the program if it has."""
    while (ended := os.waitpid(-1, os.WNOHANG))[0]:
        if ended[0] == program:
            return ended[1]
    return None


def _become(program: list[str], user: int, group: int) -> NoReturn:
    """Make the program of this process, with users and signals as it expects them."""
    for number in (*_PASSED_ON, signal.SIGPIPE, signal.SIGXFSZ):
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    try:
        linux_calls.become_user(user, group)
        os.execvp(program[0], program)
    except OSError as error:
        print(f"error: {program[0]} cannot be started: {error.strerror}", file=sys.stderr)
        os._exit(127)


def _code_of(status: int) -> int:
    code = os.waitstatus_to_exitcode(status)
    return code if code >= 0 else _BY_SIGNAL - code


if __name__ == "__main__":
    _, _parent, _user, _group, _space, _network, *_words = sys.argv
    sys.exit(main(int(_parent), int(_user), int(_group), (_space, _network), _words))
