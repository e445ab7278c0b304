import json
import socket

from dva_sim.cameras.pipes import MOST_WAITING, LineOutbox, LinePipe


def kinds(outbox):
    return [json.loads(outbox.pop())["k"] for _ in range(len(outbox))]


def test_of_some_kinds_only_the_newest_waits():
    outbox = LineOutbox()
    for number in range(5):
        outbox.put({"k": "pos", "n": number})
        outbox.put({"k": "seat", "n": number}, f"client {number % 2}")
        outbox.put({"k": "story", "n": number})
    assert sorted(kinds(outbox)) == ["pos", "seat", "seat", *["story"] * 5]
    assert outbox.dropped == 4 + 3


def test_a_full_outbox_loses_the_oldest_that_may_be_lost_and_counts_it():
    outbox = LineOutbox()
    outbox.put({"k": "scene"})
    for number in range(MOST_WAITING + 20):
        outbox.put({"k": "story", "n": number})
        outbox.put({"k": "done", "id": number}) if number < 5 else None
    told = [json.loads(outbox.pop()) for _ in range(len(outbox))]
    assert told[0] == {"k": "scene"}
    assert [line["id"] for line in told if line["k"] == "done"] == [0, 1, 2, 3, 4]
    assert [line["n"] for line in told if line["k"] == "story"][-1] == MOST_WAITING + 19
    assert outbox.dropped > 20


def test_a_pipe_that_nobody_reads_takes_no_time_and_says_all_later():
    ours, theirs = socket.socketpair()
    pipe = LinePipe(ours)
    for _ in range(200):
        pipe.put({"k": "hazards", "cells": "x" * 10_000})
    assert pipe.outbox.dropped > 100
    said = b""
    theirs.settimeout(5.0)
    while not pipe.flush() or not said.endswith(b"\n"):
        said += theirs.recv(1 << 20)
    assert all(json.loads(line)["k"] == "hazards" for line in said.splitlines())
    theirs.close()
    assert pipe.lines() == []
    assert not pipe.is_open
    pipe.close()


def test_what_is_no_line_is_left_out():
    ours, theirs = socket.socketpair()
    pipe = LinePipe(ours)
    theirs.sendall(b'{"do":1}\nnonsense\n[1]\n{"do"')
    assert pipe.lines() == [{"do": 1}]
    theirs.sendall(b":2}\n")
    assert pipe.lines() == [{"do": 2}]
    pipe.close()
    theirs.close()
