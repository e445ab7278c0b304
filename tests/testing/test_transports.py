"""Bad transports: the check names the promise that each breaks."""

import time

import pytest

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.middleware import CommandTransport, TransportEnd, TransportError
from dva_sim.network.middleware.udp import UdpTransport
from dva_sim.testing import transports
from dva_sim.testing.promises import tried
from dva_sim.testing.transports import check_transport


class Around(TransportEnd):
    """Hands everything to another end."""

    def __init__(self, end):
        self._end = end

    def send(self, data):
        return self._end.send(data)

    def serve(self, until):
        self._end.serve(until)

    def close(self):
        self._end.close()


class Over(CommandTransport):
    """UDP with another kind of end at either side."""

    near_end = far_end = Around

    def near(self, place, receive):
        return self.near_end(UdpTransport().near(place, receive))

    def far(self, place, receive):
        return self.far_end(UdpTransport().far(place, receive))


class Eats(Around):
    def send(self, data):
        return True


class Alters(Around):
    def send(self, data):
        return self._end.send(data[:-1] + b"?")


class Stalls(Around):
    def send(self, data):
        time.sleep(0.01)
        return self._end.send(data)


class Stays(Around):
    def close(self):
        kept.append(self._end)


class Oversleeps(Around):
    def serve(self, until):
        time.sleep(transports.SLACK_S + 0.5)


kept: list[TransportEnd] = []


def but(**changed):
    return type("Bad", (Over,), changed)


class Impatient(Over):
    def near(self, place, receive):
        raise TransportError("nobody is there yet")


@pytest.mark.system
@pytest.mark.parametrize(
    ("bad", "promise"),
    [
        (but(near_end=Eats), transports.CARRIES),
        (but(near_end=Alters), transports.CARRIES),
        (but(far_end=Eats), transports.SHOWS),
        (but(far_end=Alters), transports.SHOWS),
        (but(near_end=Stalls), transports.GOES_ON),
        (but(far_end=Stays), transports.LEAVES),
        (but(near_end=Oversleeps), transports.RETURNS),
        (Impatient, transports.CONNECTS),
    ],
    ids=lambda given: getattr(given, "__name__", given),
)
def test_a_transport_that_breaks_a_promise_is_told_of_it(bad, promise, monkeypatch):
    monkeypatch.setattr(transports, "ARRIVES_S", 0.5)
    monkeypatch.setattr(transports, "CONNECTS_S", 1.0)
    monkeypatch.setattr(transports, "SLACK_S", 0.2)
    outcome = tried(check_transport, bad)
    while kept:
        kept.pop().close()
    assert [text for text in outcome.broken if text.startswith(f"{promise}: ")]


def test_what_is_not_installed_is_said_with_the_extra_that_brings_it(monkeypatch):
    made = type("Needy", (Over,), {"title": "Needy", "library": "no_such_library", "extra": "much"})
    assert made().lacks() == "Needy needs no_such_library: pip install -e '.[much]'"
    made = type("Needy", (Over,), {"title": "Needy", "program": "no-such-program"})
    assert made().lacks() == "Needy needs the program no-such-program"
    with pytest.raises(ConfigError, match="no-such-program"):
        check_transport(made)
