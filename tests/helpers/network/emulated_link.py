"""Support for tests of the emulated link: availability, and processes it starts."""

import os
import select
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest
from helpers.processes.patience import PATIENCE_S, becomes

from dva_sim.network.emulator.needs import EmulatorError
from dva_sim.validation.network.real_side.cell import EmulatedJob, run_job


@cache
def missing(rootless: bool = False) -> str:
    """Reason why the emulated link is not available; empty if it is."""
    try:
        run_job(EmulatedJob("nothing", rootless=rootless))
    except EmulatorError as error:
        return str(error)
    return ""


def need_link(rootless: bool = False) -> None:
    """Skip the test where packets cannot be emulated, and say why."""
    if missing(rootless):
        pytest.skip(f"no emulated link here: {missing(rootless)}")


def children(parent: int) -> list[int]:
    """Processes that another one started and that live, oldest first."""
    with suppress(FileNotFoundError):
        text = Path(f"/proc/{parent}/task/{parent}/children").read_text()
        return [int(word) for word in text.split()]
    return []


def wait_for_children(parent: int, count: int) -> list[int]:
    """The processes that another one starts, as soon as there are so many."""
    assert becomes(lambda: len(children(parent)) == count)
    return children(parent)


def networks(*processes: int) -> set[str]:
    """The network namespaces of some processes."""
    return {str(Path(f"/proc/{process}/ns/net").readlink()) for process in processes}


def all_end(handles: list[int]) -> bool:
    """True if the processes of these pidfds end within patience; closes the pidfds."""
    waiting = set(handles)
    while waiting and (ended := select.select(list(waiting), [], [], PATIENCE_S)[0]):
        waiting -= set(ended)
    for handle in handles:
        os.close(handle)
    return not waiting
