"""Access rights: decided for each request, before anything else looks at it."""

import ipaddress
import socket

import pytest

from dva_sim.console.pages.addresses import own_address
from dva_sim.console.web.access import Role, Tokens, rules
from dva_sim.serving.admission import RequestFacts

TOKENS = Tokens("looks", "drives", dispatch="sends", supervise="rules")
HERE = rules("127.0.0.1", 8123, tokens=TOKENS)


def test_a_role_belongs_to_a_token_wherever_it_is_shown():
    cookie = {"cookie": "other=1; dva_sim_8123=looks"}
    assert HERE.role(cookie, {}) is Role.LOOK
    assert HERE.role({}, {"token": "drives"}) is Role.DRIVE
    assert HERE.role({"authorization": "Bearer drives"}, {}) is Role.DRIVE
    assert HERE.role(cookie, {"token": "drives"}) is Role.DRIVE
    assert HERE.role(cookie, {"token": "sends"}) is Role.DISPATCH
    assert HERE.role({"authorization": "Bearer sends"}, {"token": "rules"}) is Role.SUPERVISE
    assert HERE.role({}, {"token": "sends"}) < Role.SUPERVISE


@pytest.mark.parametrize(
    "shown", ["", "look", "looksdrives", "DRIVES", "drives\x00", "dr\u00efves"]
)
def test_anything_else_is_no_token(shown):
    assert HERE.role({"cookie": f"dva_sim_8123={shown}"}, {"token": shown}) is Role.NOBODY


def test_a_cookie_of_another_port_is_no_token():
    assert HERE.role({"cookie": "dva_sim_8124=drives"}, {}) is Role.NOBODY
    assert HERE.role({"cookie": ";;;=\x00,"}, {}) is Role.NOBODY


def test_the_cookie_is_kept_from_scripts_and_other_sites():
    parts = HERE.cookie_for(Role.LOOK).split("; ")
    assert parts == ["dva_sim_8123=looks", "HttpOnly", "SameSite=Strict", "Path=/"]


def test_tokens_are_long_and_differ():
    one, two = Tokens.drawn(), Tokens.drawn()
    assert len({*vars(one).values(), *vars(two).values()}) == 10
    assert min(map(len, (*vars(one).values(),))) >= 32


def test_without_tokens_everybody_may_do_all_but_no_foreign_page():
    free = rules("127.0.0.1", 8123, tokens=Tokens())
    assert free.role({}, {}) is Role.SUPERVISE
    assert free.own.refusal(RequestFacts("127.0.0.1:8123", "http://evil.example"))[0] == 403
    assert free.own.refusal(RequestFacts("evil.example:8123", "http://evil.example:8123"))[0] == 421


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_an_address_for_all_is_told_as_one_that_leads_here(host):
    reported = ipaddress.ip_address(own_address(host))
    assert not reported.is_unspecified
    with socket.socket(socket.AF_INET if reported.version == 4 else socket.AF_INET6) as here:
        here.bind((str(reported), 0))
