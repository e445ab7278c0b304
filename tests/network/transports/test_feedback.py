"""Feedback of acknowledgements to a sender."""

import math

import pytest

from dva_sim.network.transports.feedback import Feedback, RoundTrips
from dva_sim.network.transports.pace import Pace


def test_the_first_sample_of_200_ms_gives_a_time_out_of_a_second_the_least_there_is():
    trips = RoundTrips()
    trips.add(0.2)
    assert trips.smoothed == 0.2
    assert trips.timeout == 1.0  # 0.2 + 4 * 0.1 is below it


def test_the_second_sample_moves_mean_and_variation_as_rfc_6298_says():
    trips = RoundTrips()
    trips.add(1.0)
    trips.add(2.0)
    # variation 0.75 * 0.5 + 0.25 * 1, mean 7/8 + 2/8
    assert trips.smoothed == pytest.approx(1.125)
    assert trips.timeout == pytest.approx(1.125 + 4 * 0.625)


def test_each_time_out_doubles_the_next_until_something_is_heard():
    trips = RoundTrips()
    trips.add(0.2)
    trips.back_off()
    trips.back_off()
    assert trips.timeout == 4.0
    trips.add(0.2)
    assert trips.timeout == 1.0


def test_a_datagram_is_lost_when_three_later_ones_were_acknowledged():
    feedback = Feedback()
    for number in range(5):
        feedback.sent(0.01 * number, number)
    assert feedback.acknowledged(0.2, [(1, 0.0)]) == []
    assert feedback.acknowledged(0.21, [(2, 0.0)]) == []
    assert feedback.acknowledged(0.22, [(3, 0.0)]) == [0]
    assert feedback.lost == 1


def test_what_a_lost_acknowledgement_said_the_next_one_says_too():
    feedback = Feedback()
    for number in range(4):
        feedback.sent(0.0, number)
    assert feedback.acknowledged(0.2, [(number, 0.0) for number in range(4)]) == []
    assert feedback.deadline == math.inf  # nothing is pending


def test_how_long_the_other_side_held_a_datagram_is_no_part_of_the_round_trip():
    feedback = Feedback()
    feedback.sent(1.0, 0)
    feedback.acknowledged(1.5, [(0, 0.3)])
    assert feedback.samples == pytest.approx([0.2])


def test_without_any_answer_everything_is_given_up_after_the_first_second():
    feedback = Feedback()
    feedback.sent(2.0, 0)
    feedback.sent(2.5, 1)
    assert feedback.deadline == 3.0
    assert feedback.give_up() == [0, 1]


class RecordingLaw:
    """Congestion law that records its input."""

    gap = 0.5

    def __init__(self) -> None:
        self.heard: list[object] = []

    def begin(self, round_trip: float) -> None:
        self.heard.append(("begin", round_trip))

    def passed(self, round_trip: float, is_held: bool) -> None:
        self.heard.append(("passed", round_trip, is_held))

    def lost(self) -> None:
        self.heard.append("lost")


def test_a_law_hears_of_one_loss_per_round_trip_however_many_there_were():
    law, feedback = RecordingLaw(), Feedback()
    pace = Pace(law, feedback)
    feedback.sent(0.0, 0)
    feedback.acknowledged(0.2, [(0, 0.0)])
    pace.heard(0.2)
    for now in (0.3, 0.35, 0.45, 0.51):
        pace.lost(now)
    assert law.heard == [("begin", 0.2), "lost", "lost"]  # at 0.3, and more than 0.2 later


def test_a_law_hears_of_a_round_trip_once_it_has_passed_with_the_mean_of_its_samples():
    law, feedback = RecordingLaw(), Feedback()
    pace = Pace(law, feedback)
    for now, number in ((0.0, 0), (0.2, 1), (0.3, 2)):
        feedback.sent(now, number)
    for now, number in ((0.2, 0), (0.39, 1), (0.51, 2)):  # 200, 190 and 210 ms
        feedback.acknowledged(now, [(number, 0.0)])
        pace.heard(now)
        pace.held = True
    assert law.heard == [("begin", 0.2), ("passed", pytest.approx(0.2), True)]


def test_before_the_first_answer_ten_datagrams_may_go_and_then_one_per_time_out():
    pace, gaps = Pace(RecordingLaw(), Feedback()), []
    for _ in range(12):
        gaps.append(pace.gap)
        pace.sent()
    assert gaps == [0.0] * 10 + [1.0, 1.0]
