"""The loop of an end whose library wants one: what goes on while it serves."""

import asyncio
import gc
import time

import pytest

from dva_sim.network.middleware.ends import TransportError
from dva_sim.network.middleware.event_loop import LoopEnd


class End(LoopEnd):
    """An end that sends nothing."""

    def send(self, data: bytes) -> bool:
        return False


def test_what_has_begun_goes_on_though_nobody_else_knows_of_it_and_ends_with_the_end():
    """The loop itself keeps no task that waits from being collected."""
    end, ended = End(), list[str]()

    async def work() -> None:
        try:
            await asyncio.get_running_loop().create_future()
        finally:
            ended.append("over")

    end.begin(work())
    end.serve(time.monotonic())
    gc.collect()
    assert ended == []
    end.close()
    assert ended == ["over"]


def test_the_failure_of_what_has_begun_ends_nothing_else():
    end, done = End(), list[int]()

    async def work(number: int) -> None:
        done.append(number)
        raise OSError("broken")

    for number in range(3):
        end.begin(work(number))
        end.serve(time.monotonic())
    assert done == [0, 1, 2]
    end.close()


def test_who_is_not_there_is_tried_until_the_time_is_up():
    end, tries = End(), list[int]()

    async def connect() -> None:
        tries.append(1)
        raise ConnectionRefusedError

    with pytest.raises(TransportError, match="does not answer"):
        end.reach(connect, time.monotonic() + 0.25)
    assert len(tries) > 1
    end.close()
