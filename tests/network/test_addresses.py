"""Addresses of devices as people write them."""

import pytest
from helpers.wording import unnamed

from dva_sim.network.addresses import problem_of


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("[::1]:5733", ["IPv6"]),
        ("::1:5600", ["IPv6"]),
        ("127.0.0.1:0", ["port 0", "1 to 65534"]),
        ("127.0.0.1:99999", ["port 99999", "65534"]),
        ("127.0.0.1:65535", ["port 65535", "65534"]),
        ("localhost", ["no port"]),
        (":5600", ["no host"]),
        ("bad host:5600", ["no host"]),
        ("host:1:2", ["two colons"]),
        ("host:five", ["no number"]),
    ],
)
def test_an_address_is_told_which_part_of_it_is_wrong(text, names):
    assert unnamed(problem_of(text), *names) == []


@pytest.mark.parametrize("text", ["127.0.0.1:5600", "localhost:1", "robot.lan:65534"])
def test_an_address_of_a_host_and_a_port_is_one(text):
    assert problem_of(text) == ""
