"""Deciders and pipes of the console's world, by themselves."""

import cmath
import json
import socket

import pytest

from dva_sim.cameras.pipes import MOST_WAITING, LineOutbox, LinePipe
from dva_sim.console.asking.answers import Answers
from dva_sim.console.asking.refusal import Refused
from dva_sim.console.lag import GOOD_FOR, LIMIT, LagRule
from dva_sim.console.link import changed
from dva_sim.console.seats import MOST_SEATS, SILENT_AFTER, Seats
from dva_sim.console.tour import FAR, LEAST, tour_of
from dva_sim.console.wire.actions import ACTIONS
from dva_sim.console.wire.kinds import BadMessage
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.network.link import LinkConfig
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.scenario import build, load


def test_lag_holds_once_and_lets_go_after_it_was_good_for_a_while():
    rule = LagRule()
    assert not rule.measured(0.0, LIMIT)
    assert rule.measured(1.0, LIMIT + 0.01)
    assert not rule.measured(1.1, 2.0)
    assert rule.held
    rule.measured(1.1 + 0.9 * GOOD_FOR, 0.0)
    assert rule.held
    rule.measured(1.1 + GOOD_FOR, 0.0)
    assert not rule.held
    assert rule.measured(5.0, 1.0)


def test_a_client_keeps_its_seat_and_the_lowest_free_one_is_given():
    seats = Seats()
    assert [seats.sit(client) for client in ("a", "b", "a", "c")] == [0, 1, 0, 2]
    assert seats.stand_up("b") == 1
    assert seats.stand_up("b") is None
    assert seats.sit("d") == 1
    for number in range(MOST_SEATS):
        seats.sit(f"more {number}")
    assert seats.sit("one too many") is None


def test_who_holds_on_and_says_nothing_is_told_of_once():
    seats = Seats()
    assert not seats.heard("nobody", 0.0, True)
    seats.sit("a")
    seats.heard("a", 1.0, True)
    assert seats.silent(1.0 + 0.9 * SILENT_AFTER) == []
    assert seats.silent(1.1 + SILENT_AFTER) == ["a"]
    assert seats.silent(9.0) == []
    seats.heard("a", 10.0, False)
    assert seats.silent(20.0) == []


def test_an_action_is_done_once_and_answered_as_often_as_it_is_said():
    answers, done, told = Answers(), [], []

    def do(said):
        done.append(1)
        said(True, "done", more=3)

    for _ in range(3):
        answers.once("1", do, told.append)
    assert done == [1]
    assert told == [{"k": "done", "id": "1", "ok": True, "text": "done", "more": 3}] * 3


def test_who_asks_again_before_there_is_an_answer_is_told_with_it():
    answers, waiting, told = Answers(), [], []
    answers.once("1", waiting.append, told.append)
    answers.once("1", waiting.append, told.append)
    assert told == []
    (said,) = waiting
    said(True, "at last")
    assert [answer["text"] for answer in told] == ["at last"]


@pytest.mark.parametrize("error", [Refused("no"), ConfigError("no"), DvaSimError("no")])
def test_what_is_refused_is_the_answer(error):
    def do(said):
        raise error

    answers, told = Answers(), []
    answers.once("1", do, told.append)
    assert told == [{"k": "done", "id": "1", "ok": False, "text": "no"}]


def test_answers_are_forgotten_in_time():
    answers = Answers()
    for number in range(Answers.MOST + 10):
        answers.once(str(number), lambda said: said(True, ""), lambda _: None)
    assert len(answers.given) == Answers.MOST


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


def test_sliders_keep_what_they_do_not_change():
    link = LinkConfig(delay_s=0.2, loss=0.1, queue_bytes=9_000, up={"delay_s": 0.4})
    made = changed(link, {"delay_s": 0.3})
    assert (made.loss, made.queue_bytes) == (0.1, 9_000)
    assert made.toward("up").delay_s == made.toward("down").delay_s == 0.3


def test_jitter_takes_the_place_of_a_law_and_loss_that_of_bursts():
    law = {"law": "normal", "sd_s": 0.01}
    made = changed(LinkConfig(delay_s=0.2, delay_law=law), {"jitter_s": 0.1})
    assert (made.delay_law, made.jitter_s) == (None, 0.1)
    made = changed(LinkConfig(loss=0.1, bursts={"mean_s": 1.0}), {"loss": 0.2})
    assert (made.bursts, made.loss) == (None, 0.2)


def test_a_delay_that_a_law_cannot_have_is_refused_in_a_line():
    law = {"law": "normal", "sd_s": 0.05}
    with pytest.raises(ConfigError) as told:
        changed(LinkConfig(delay_s=0.2, delay_law=law), {"delay_s": 0.01})
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("given", [{"delay_s": 5.1}, {"loss": "much"}, {"rate_bps": True}])
def test_numbers_beyond_the_sliders_are_refused(given):
    with pytest.raises(BadMessage, match=next(iter(given))):
        ACTIONS["link"].read(given)


@pytest.mark.parametrize("seed", range(1, 6))
def test_both_goals_of_the_tour_lie_alike_and_are_free(seed):
    run = Run(build(load("hands-on")), seed)
    tour = tour_of(run, dict(zip(run.field.robots, range(2), strict=True)))
    seen = []
    for robot, (x, y) in zip(run.field.robots.values(), tour["goals_m"], strict=True):
        pose = robot.body.pose()
        assert run.stage.site.is_free(x, y, robot.body.radius)
        seen.append(complex(x - pose.x, y - pose.y) * cmath.exp(-1j * pose.heading))
    assert abs(seen[0] - seen[1]) < 0.05
    assert LEAST <= abs(seen[0]) <= FAR + 0.1
    assert seen[0] == pytest.approx(cmath.rect(tour["length_m"], tour["side_rad"]), abs=0.05)


def test_one_robot_has_no_tour():
    run = Run(build(load("drive-to-event")), 1)
    assert tour_of(run, dict.fromkeys(run.field.robots, 0)) is None
