"""Pipes: the high-water mark, the low one at half of it, and keeping only the newest."""

import pytest

from dva_sim.network.zmtp import Pipe, ReceivePipe


@pytest.mark.parametrize(("mark", "low"), [(1, 1), (2, 1), (3, 2), (10, 5), (1000, 500)])
def test_a_full_pipe_has_room_again_when_half_of_it_has_been_read(mark, low):
    pipe: Pipe[int] = Pipe(mark)
    assert [pipe.put(number) for number in range(mark + 1)] == [True] * mark + [False]
    for _ in range(low - 1):
        pipe.take()
        assert not pipe.put(-1)
    pipe.take()
    assert [pipe.put(number) for number in range(low + 1)] == [True] * low + [False]


def test_who_was_refused_is_told_once_when_there_is_room():
    pipe, told = Pipe[int](4), list[int]()
    pipe.on_room = lambda: told.append(len(pipe))
    for number in range(5):
        pipe.put(number)
    assert [pipe.take() for _ in range(4)] == [0, 1, 2, 3]
    assert told == [2]


def test_what_conflates_keeps_the_newest_and_is_never_full():
    pipe = Pipe[int](1, conflate=True)
    assert all(pipe.put(number) for number in range(5))
    assert (len(pipe), pipe.superseded, pipe.take(), pipe.take()) == (1, 4, 4, None)


class Flow:
    def __init__(self) -> None:
        self.said: list[str] = []

    def pause(self) -> None:
        self.said.append("pause")

    def resume(self) -> None:
        self.said.append("resume")


def test_a_full_receiver_lets_its_connection_wait_until_half_is_read():
    pipe, flow = ReceivePipe[int](4), Flow()
    pipe.flow = flow
    for number in range(4):
        pipe.put(number)
    assert flow.said == ["pause"]
    pipe.take()
    assert flow.said == ["pause"]
    pipe.take()
    assert flow.said == ["pause", "resume"]
