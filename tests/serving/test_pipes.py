import asyncio
import json
import os
import socket

from dva_sim.serving import pipes
from dva_sim.serving.pipes import MAX_WAITING, LineKinds, LineOutbox, LinePipe, PipeEnd, WatchedEnd

KINDS = LineKinds(newest=frozenset({"pos", "seat", "hazards"}), kept=frozenset({"scene", "done"}))


def kinds(outbox):
    return [json.loads(outbox.next())["k"] for _ in range(len(outbox))]


def test_of_some_kinds_only_the_newest_waits():
    outbox = LineOutbox(KINDS)
    for number in range(5):
        outbox.put({"k": "pos", "n": number})
        outbox.put({"k": "seat", "n": number}, f"client {number % 2}")
        outbox.put({"k": "story", "n": number})
    assert sorted(kinds(outbox)) == ["pos", "seat", "seat", *["story"] * 5]
    assert outbox.dropped == 4 + 3


def test_a_full_outbox_loses_the_oldest_that_may_be_lost_and_counts_it():
    outbox = LineOutbox(KINDS)
    outbox.put({"k": "scene"})
    for number in range(MAX_WAITING + 20):
        outbox.put({"k": "story", "n": number})
        outbox.put({"k": "done", "id": number}) if number < 5 else None
    reports = [json.loads(outbox.next()) for _ in range(len(outbox))]
    assert reports[0] == {"k": "scene"}
    assert [line["id"] for line in reports if line["k"] == "done"] == [0, 1, 2, 3, 4]
    assert [line["n"] for line in reports if line["k"] == "story"][-1] == MAX_WAITING + 19
    assert outbox.dropped > 20


def test_a_pipe_that_nobody_reads_takes_no_time_and_says_all_later():
    ours, theirs = socket.socketpair()
    pipe = LinePipe(ours.detach(), KINDS)
    for _ in range(200):
        pipe.put({"k": "hazards", "cells": "x" * 10_000})
    assert pipe.outbox.dropped > 100
    reported = b""
    theirs.settimeout(5.0)
    while not pipe.flush() or not reported.endswith(b"\n"):
        reported += theirs.recv(1 << 20)
    assert all(json.loads(line)["k"] == "hazards" for line in reported.splitlines())
    theirs.close()
    assert pipe.lines() == []
    assert not pipe.is_open
    pipe.close()


def test_what_is_no_line_is_left_out():
    ours, theirs = socket.socketpair()
    pipe = LinePipe(ours.detach(), KINDS)
    theirs.sendall(b'{"do":1}\nnonsense\n[1]\n{"do"')
    assert pipe.lines() == [{"do": 1}]
    theirs.sendall(b":2}\n")
    assert pipe.lines() == [{"do": 2}]
    pipe.close()
    theirs.close()


def test_a_line_that_does_not_end_ends_the_pipe(monkeypatch):
    monkeypatch.setattr(pipes, "MAX_LINE", 1000)
    ours, theirs = socket.socketpair()
    pipe = LinePipe(ours.detach(), KINDS)
    theirs.sendall(b'{"do":1}\n' + b"x" * 900)
    assert pipe.lines() == [{"do": 1}]
    theirs.sendall(b"x" * 200)
    assert pipe.lines() == []
    assert not pipe.is_open
    pipe.close()
    theirs.close()


def test_what_is_offered_is_written_whole_or_not_at_all():
    reads, writes = os.pipe()
    pipe, line = PipeEnd(writes), b"x" * 999 + b"\n"
    taken = 0
    while pipe.offer(line):
        taken += 1
    reported = b""
    while len(reported) < taken * len(line):
        reported += os.read(reads, 1 << 20)
        pipe.flush()
    assert reported == line * taken
    os.close(reads)
    # The first offer finds that nobody reads any longer.
    assert [pipe.offer(line), pipe.offer(line)] == [
        True,
        False,
    ]  # the first finds that nobody reads
    pipe.close()
    pipe.close()
    assert (pipe.fileno(), pipe.offer(line)) == (-1, False)


def test_in_an_event_loop_what_waits_is_written_when_there_is_room_and_the_end_is_said_once():
    waiting = [b"%d\n" % number * 50_000 for number in range(10)]
    all_of_it = b"".join(waiting)
    taken, ended = [], []

    async def story():
        ours, theirs = socket.socketpair()
        theirs.setblocking(False)
        loop = asyncio.get_running_loop()

        def following():
            return waiting.pop(0) if waiting else None

        pipe = WatchedEnd(loop, ours.detach(), taken.append, lambda: ended.append(1), following)
        assert not pipe.flush()
        reported = b""
        while len(reported) < len(all_of_it):
            reported += await loop.sock_recv(theirs, 1 << 20)
        assert reported == all_of_it
        theirs.send(b"bye")
        theirs.close()
        while not ended:
            await asyncio.sleep(0)
        assert (pipe.fileno(), pipe.offer(b"more")) == (-1, False)
        pipe.close()
        await asyncio.sleep(0)

    asyncio.run(story())
    assert (taken, ended) == ([b"bye"], [1])
