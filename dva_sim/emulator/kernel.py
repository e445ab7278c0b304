"""The few calls of Linux that Python does not offer: namespaces, parent's death, priority.

Only the C library is needed; the numbers are part of the kernel's stable interface
(unshare(2), prctl(2), user_namespaces(7), sched(7)).
"""

from __future__ import annotations

import ctypes
import os
import signal
from contextlib import suppress
from pathlib import Path

CLONE_NEWUSER = 0x10000000
CLONE_NEWNET = 0x40000000
_PR_SET_PDEATHSIG = 1
_PR_SET_TIMERSLACK = 29


def enter_network_namespace() -> None:
    """Leave the network of the parent for a new and empty one that dies with its processes.

    Raises:
        OSError: forbidden here.
    """
    _check(_libc().unshare(CLONE_NEWNET), "a network namespace")


def become_owner() -> str:
    """Be allowed to make network namespaces: as root, or as root of a new user namespace.

    Returns:
        `root` or `user namespace`.

    Raises:
        OSError: neither is allowed here.
    """
    try:
        enter_network_namespace()
        return "root"
    except PermissionError:
        become_root_of_a_user_namespace()
        return "user namespace"


def become_root_of_a_user_namespace() -> None:
    """Be root among namespaces of one's own, and nowhere else.

    Raises:
        OSError: forbidden here.
    """
    user, group = os.getuid(), os.getgid()
    _check(_libc().unshare(CLONE_NEWUSER | CLONE_NEWNET), "a user namespace")
    Path("/proc/self/setgroups").write_text("deny", encoding="ascii")
    Path("/proc/self/uid_map").write_text(f"0 {user} 1", encoding="ascii")
    Path("/proc/self/gid_map").write_text(f"0 {group} 1", encoding="ascii")


def die_with_parent(parent: int) -> None:
    """Be killed when the process that started this one ends, however it ends.

    Args:
        parent: Its id, as it knows it: if it is gone already, this process ends here.
    """
    _check(_libc().prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0), "to die with the parent")
    if os.getppid() != parent:
        os._exit(1)


def be_punctual(priority: int) -> bool:
    """Ask for exact timers and real-time priority; whether the latter was granted."""
    _libc().prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    return os.sched_getscheduler(0) == os.SCHED_FIFO


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def _check(result: int, what: str) -> None:
    if result != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{what} is refused: {os.strerror(number)}")
