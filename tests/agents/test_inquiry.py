"""Inquiries of a robot to the DVA, and the effect of their replies."""

import math
import random

import pytest

from dva_sim.agents.robot.inquiry import BURST, MAX_READERS, RATE, Inquiry
from dva_sim.protocol import messages as m

ANA, RUI = "02:00:00:03:00:01", "02:00:00:03:00:02"
NOBODY = m.Reply(1, m.NOT_PERMITTED, "")
HOLDS = m.Reply(1, m.OK, "", m.Permission(ANA, "both", 7))


def test_one_question_is_under_way_at_a_time_and_claims_meanwhile_make_one_more():
    inquiry = Inquiry()
    for _ in range(1000):
        inquiry.about_holder(RUI)
    assert inquiry.next(0.0) == m.GetGrant()
    for _ in range(1000):
        inquiry.about_holder(RUI)
        assert inquiry.next(0.0) is None
    inquiry.answered(HOLDS)
    assert inquiry.next(0.0) == m.GetGrant()
    inquiry.answered(HOLDS)
    assert (inquiry.next(0.0), inquiry.due(0.0)) == (None, math.inf)


@pytest.mark.parametrize("seed", range(20))
def test_a_question_may_be_asked_at_the_time_that_was_told_to_the_microsecond(seed):
    """Otherwise a caller who asks at the due time gets the same time again, for ever."""
    rng, inquiry, now, asked = random.Random(seed), Inquiry(), 0.0, 0
    while now < 30.0:
        inquiry.about_holder(RUI)
        if inquiry.next(now) is not None:
            asked += 1
            inquiry.answered(NOBODY)
            inquiry.about_holder(RUI)
        due = round(inquiry.due(now), 6)
        if due > now:
            now = due
            assert inquiry.next(now) is not None
            asked += 1
            inquiry.answered(NOBODY)
        now = round(now + rng.random() * rng.choice([1e-6, 1e-3, 1.0]), 6)
    assert asked <= BURST + RATE * now + 1


def test_readers_and_the_holder_take_turns_and_readers_are_bounded():
    inquiry, asked = Inquiry(), list[m.GetGrant | None]()
    for number in range(2 * MAX_READERS):
        inquiry.about_reader(f"02:00:00:0F:00:{number:02X}")
    for _ in range(6):
        inquiry.about_holder(RUI)
        asked.append(inquiry.next(1000.0 * (len(asked) + 1)))
        inquiry.answered(NOBODY)
    assert [question and question.level for question in asked] == [None, "sensors"] * 3


def test_a_dva_of_1_4_is_asked_about_the_device_that_was_named_last():
    inquiry = Inquiry()
    inquiry.about_holder(RUI)
    inquiry.about_holder(ANA)
    assert inquiry.next(0.0) == m.GetGrant()
    assert inquiry.answered(m.Reply(0, m.BAD_MESSAGE, "")) is None
    assert inquiry.next(0.0) == m.GetGrant(ANA)
    assert inquiry.answered(HOLDS) == m.GetGrant(ANA)


def test_a_dva_before_1_4_settles_nothing_and_is_not_asked_on_and_on():
    inquiry = Inquiry()
    inquiry.about_holder(ANA)
    for _ in range(2):
        assert inquiry.next(0.0) is not None
        inquiry.answered(m.Reply(0, m.BAD_MESSAGE, ""))
    assert inquiry.next(0.0) is None


@pytest.mark.parametrize("code", [m.NOT_REGISTERED, None])
def test_a_dva_that_does_not_answer_or_does_not_know_the_robot_is_asked_again(code):
    inquiry = Inquiry()
    inquiry.about_holder(ANA)
    inquiry.next(0.0)
    if code is None:
        inquiry.unanswered()
    else:
        assert inquiry.answered(m.Reply(1, code, "")) is None
    assert inquiry.next(0.0) == m.GetGrant()


def test_an_answer_to_no_question_settles_nothing():
    assert Inquiry().answered(HOLDS) is None
