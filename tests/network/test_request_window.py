"""Number of unanswered requests that the pattern `paced` allows, on exactly known paths."""

import heapq

import pytest

from dva_sim.network.request_window import MAX_UNANSWERED, RequestWindow


def played(*, round_trip, service=0.0, rate_hz=10.0, lasts=60.0, slower_from=None):
    """Size of the window over time, of a sender beside a path and a server of one at a time.

    Args:
        round_trip: Without the service [s].
        service: Time the server needs for each request [s].
        rate_hz: Wanted requests per second.
        lasts: Length of the run [s].
        slower_from: Time at which the round trip doubles [s].

    Returns:
        Pairs of a time and the size then, and the time each request waited for the server [s].
    """
    window, sizes, waits = RequestWindow(rate_hz), [], []
    free, answers = 0.0, []
    for tick in range(int(lasts * rate_hz)):
        now = tick / rate_hz
        while answers and answers[0][0] <= now:
            at, number, sent = heapq.heappop(answers)
            window.answered(number, at - sent, at)
        if window.is_open:
            path = round_trip * (2 if slower_from is not None and now > slower_from else 1)
            arrives = now + path / 2
            begins = max(arrives, free)
            free = begins + service
            waits.append(begins - arrives)
            heapq.heappush(answers, (free + path / 2, window.sent(), now))
        sizes.append((now, window.size))
    return sizes, waits


def after(sizes, time):
    return [size for at, size in sizes if at >= time]


@pytest.mark.parametrize("round_trip", [0.55, 1.05, 2.05])
def test_where_nothing_queues_all_wanted_requests_go(round_trip):
    sizes, waits = played(round_trip=round_trip)
    needed = round_trip * 10.0
    assert min(after(sizes, 20.0)) >= needed
    assert max(waits) == 0.0
    assert max(size for _, size in sizes) <= MAX_UNANSWERED


@pytest.mark.parametrize("service", [0.2, 0.3, 1.0])
def test_a_server_that_is_slower_than_what_is_wanted_has_a_short_queue(service):
    sizes, waits = played(round_trip=0.04, service=service)
    settled = waits[len(waits) // 3 :]
    assert sorted(settled)[len(settled) // 2] < service / 2
    assert min(after(sizes, 20.0)) == 1


def test_a_path_that_becomes_longer_gets_a_wider_window_in_the_end():
    sizes, _ = played(round_trip=0.55, lasts=120.0, slower_from=40.0)
    assert min(after(sizes, 100.0)) >= 2 * 0.55 * 10.0


def test_a_window_that_is_full_is_closed_until_an_answer():
    window = RequestWindow(10.0)
    numbers = [window.sent() for _ in range(window.size)]
    assert not window.is_open
    window.answered(numbers[0], 0.1, 0.1)
    assert window.is_open


def test_answers_that_all_come_at_once_are_taken_in():
    window = RequestWindow(10.0)
    for _ in range(5):
        numbers = [window.sent() for _ in range(4)]
        for number in numbers:
            window.answered(number, 1.0, 1.0)
    assert 1 <= window.size <= MAX_UNANSWERED
