"""Promises of messaging patterns: kept by the shipped ones, missed by the bad ones."""

import itertools
from typing import Any

import pytest

from dva_sim.network.patterns import (
    LatestWins,
    Pattern,
    PubSub,
    ReqRep,
    known_patterns,
    load_pattern,
)
from dva_sim.testing.patterns import check_pattern
from dva_sim.testing.promises import BrokenPromises, tried

EXAMPLE = "acknowledged_pub_sub.py:AcknowledgedPubSub"
GROWS_OLD = {"pub-sub": ("lets commands grow old at a slow robot: 22 s",)}


@pytest.mark.parametrize("name", [*known_patterns(), EXAMPLE])
def test_every_pattern_that_is_shipped_keeps_its_promises(name):
    outcome = tried(check_pattern, name, slow=60.0)
    assert (outcome.broken, outcome.warnings) == ((), GROWS_OLD.get(name, ()))


def test_the_example_keeps_them_however_often_it_asks():
    for every in (1, 3, 30):
        check_pattern(load_pattern(EXAMPLE, {"every": every}))


def but(base: type[Pattern], **changed: Any) -> type[Pattern]:
    """A pattern that is good but for this."""
    return type("Bad", (base,), changed)


class Hoards(ReqRep):
    """Sends all, one after the other, however long that takes: the queue at the app grows."""

    def __init__(self):
        self.queue = []

    def offer(self, command):
        self.queue.append(command)
        self.go_on()

    def go_on(self, reply=b""):
        if self.queue and not self.line.busy:
            self.line.request(self.queue.pop(0), self.go_on, self.line.lost)


class Floods(PubSub):
    """Says everything twice."""

    def offer(self, command):
        super().offer(command)
        super().offer(command)


class Newest(PubSub):
    """Keeps one command back, and sends them in pairs, the newer first."""

    kept = None

    def offer(self, command):
        kept, self.kept = self.kept, command
        if kept is not None:
            self.line.publish(command)
            self.line.publish(kept)
            self.kept = None


class Timid(LatestWins):
    """Gives up at once."""

    def offer(self, command):
        super().offer(command)
        self.line.lost()


class Stubborn(ReqRep):
    """Stops for good when the robot was away."""

    def begin(self, line):
        self.line = line
        line.open_requests(attempts=1)

    def offer(self, command):
        if self.line.busy or self.waiting:
            self.line.supersede(command)
        else:
            self.line.request(command, lambda reply: None, self.stop)

    def stop(self):
        self.waiting = True
        self.line.lost()


count = itertools.count(1)


def now_and_then(self: LatestWins, command: Any) -> None:
    """All drives have one memory: every seventh command of all of them is left out."""
    if next(count) % 7:
        LatestWins.offer(self, command)
    else:
        self.line.supersede(command)


def late(self: LatestWins, command: Any) -> None:
    self.line.clock.call_after(0.25, self.line.publish, command)


class Fragile(ReqRep):
    """Takes every answer for an OK."""

    def _answered(self, reply):
        assert self.line.code_of(reply) == 0
        super()._answered(reply)


FAULTS = {
    but(LatestWins, offer=lambda self, c: c.number % 2 and LatestWins.offer(self, c)): "loses",
    Hoards: "loses commands, or keeps too many",
    Floods: "sends a command twice",
    Newest: "sends an older command",
    but(LatestWins, offer=lambda self, c: self.line.supersede(c)): "leaves the robot without",
    but(ReqRep, offer=lambda self, c: self.line.publish(c)): "publishes, and says",
    but(PubSub, answered=True): "does not find out that nobody is there",
    Timid: "gives up a robot that obeys",
    Stubborn: "does not go on with a robot",
    but(LatestWins, offer=now_and_then): "shares memory with other copies",
    but(LatestWins, offer=late): "sends when the drive is over",
    but(LatestWins, offer=lambda self, _: self.line.publish("full")): "raises: TypeError",
    but(ReqRep, begin=lambda self, line: setattr(self, "line", line)): "raises: RuntimeError: asks",
    Fragile: "raises: AssertionError",
    but(LatestWins, newest_wins="sometimes"): "says what is neither yes nor no",
}


@pytest.mark.parametrize(("kind", "promise"), FAULTS.items())
def test_a_pattern_that_breaks_a_promise_is_found_out(kind, promise):
    broken = tried(check_pattern, kind, slow=60.0).broken
    assert any(entry.startswith(promise) for entry in broken), broken


class Sleepy(LatestWins):
    """Takes its time."""

    def offer(self, command):
        sum(range(3000))
        super().offer(command)


def test_a_slow_pattern_is_a_warning():
    outcome = tried(check_pattern, Sleepy, slow=1e-6)
    assert outcome.broken == ()
    assert outcome.warnings[-1].startswith("is slow: ")


def test_check_pattern_refuses_a_bad_one_in_a_line():
    with pytest.raises(BrokenPromises, match=FAULTS[Floods]):
        check_pattern(Floods)
