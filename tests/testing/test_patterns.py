"""What every messaging pattern promises: kept by all that are shipped, missed by the bad ones."""

from __future__ import annotations

from typing import ClassVar

import pytest

from dva_sim.cli import checks
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
def test_every_pattern_that_is_shipped_keeps_its_promises(name: str) -> None:
    outcome = tried(check_pattern, name, slow=60.0)
    assert (outcome.broken, outcome.warnings) == ((), GROWS_OLD.get(name, ()))


def test_the_example_keeps_them_however_often_it_asks() -> None:
    for every in (1, 3, 30):
        check_pattern(load_pattern(EXAMPLE, {"every": every}))


class Forgets(LatestWins):
    """Drops every second command and says nothing of it."""

    def offer(self, command):
        if command.number % 2:
            super().offer(command)


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


class Mute(LatestWins):
    """Counts everything as superseded."""

    def offer(self, command):
        self.line.supersede(command)


class Silent(ReqRep):
    """Publishes, and the robot was never told to listen."""

    def offer(self, command):
        self.line.publish(command)


class Trusting(PubSub):
    """Says that it finds out, and asks nobody."""

    answered = True


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


class Shared(LatestWins):
    """All drives have one memory: every seventh command of all of them is left out."""

    seen: ClassVar = []

    def offer(self, command):
        self.seen.append(command)
        if len(self.seen) % 7:
            super().offer(command)
        else:
            self.line.supersede(command)


class Haunting(LatestWins):
    """Sends the last command again a while later, whether the drive is over or not."""

    def offer(self, command):
        self.line.clock.call_after(0.25, self.line.publish, command)


class Invents(LatestWins):
    """Sends what the app has not made."""

    def offer(self, command):
        self.line.publish("full speed")


class Unprepared(ReqRep):
    """Asks without a socket."""

    def begin(self, line):
        self.line = line


class Fragile(ReqRep):
    """Takes every answer for an OK."""

    def _answered(self, reply):
        assert self.line.code_of(reply) == 0
        super()._answered(reply)


class Vague(LatestWins):
    """Says neither yes nor no."""

    newest_wins = "sometimes"


FAULTS = {
    Forgets: "loses commands, or keeps too many",
    Hoards: "loses commands, or keeps too many",
    Floods: "sends a command twice",
    Newest: "sends an older command after a newer one",
    Mute: "leaves the robot without commands",
    Silent: "publishes, and says that it does not",
    Trusting: "does not find out that nobody is there, and says it would",
    Timid: "gives up a robot that obeys",
    Stubborn: "does not go on with a robot that is back",
    Shared: "shares memory with other copies, or draws random numbers",
    Haunting: "sends when the drive is over",
    Invents: "raises: TypeError: sends str, which the app has not made",
    Unprepared: "raises: RuntimeError: asks without open_requests()",
    Fragile: "raises: AssertionError",
    Vague: "says what is neither yes nor no",
}


@pytest.mark.parametrize(
    ("kind", "promise"), FAULTS.items(), ids=lambda x: getattr(x, "__name__", "")
)
def test_a_pattern_that_breaks_a_promise_is_found_out(kind: type[Pattern], promise: str) -> None:
    broken = tried(check_pattern, kind, slow=60.0).broken
    assert any(told.startswith(promise) for told in broken), broken


class Sleepy(LatestWins):
    """Takes its time."""

    def offer(self, command):
        sum(range(3000))
        super().offer(command)


def test_a_slow_pattern_is_a_warning() -> None:
    outcome = tried(check_pattern, Sleepy, slow=1e-6)
    assert outcome.broken == ()
    assert outcome.warnings[-1].startswith("is slow: ")


def test_check_pattern_refuses_a_bad_one_in_a_line() -> None:
    with pytest.raises(BrokenPromises, match="sends a command twice"):
        check_pattern(Floods)


def test_the_command_tells_what_is_wrong_with_a_file(tmp_path, capsys) -> None:
    path = tmp_path / "mine.py"
    path.write_text(
        "from dva_sim.network.patterns import PubSub\n\n"
        "class Mine(PubSub):\n    def offer(self, command):\n"
        "        self.line.publish(command)\n        self.line.publish(command)\n"
    )
    assert checks.check(["pattern", f"{path}:Mine"], []) == 1
    assert "sends a command twice: command 1" in capsys.readouterr().out
