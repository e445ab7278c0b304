"""Access rights: decided for each request, before anything else looks at it."""

import ipaddress
import socket

import pytest

from dva_sim.console.pages.addresses import own_address
from dva_sim.console.web.access import Asked, Role, Tokens, name_in, rules

TOKENS = Tokens("looks", "drives", dispatch="sends", supervise="rules")
HERE = rules("127.0.0.1", 8123, tokens=TOKENS)
EVERYWHERE = rules("0.0.0.0", 8123, ["Lab-PC.example"], TOKENS)


def test_a_local_console_answers_to_the_names_of_this_machine_and_to_no_other():
    for host in ("127.0.0.1", "localhost", "LOCALHOST", "[::1]"):
        for port in ("", ":8123", ":9"):
            assert HERE.refusal(Asked(host + port)) is None, host + port
    others = ["evil.example:8123", "localhost.evil.example", "127.0.0.1.nip.io:8123", "", "::1"]
    others += ["127.0.0.1@evil.example", "10.0.0.7:8123", "[::2]:8123", "[::1", " localhost"]
    for host in (*others, "localhost:8123:1", "localhost:"):
        assert HERE.refusal(Asked(host))[0] == 421, host


def test_served_on_all_addresses_it_answers_to_addresses_and_given_names_only():
    for host in ("10.0.0.7:8123", "[fe80::1]:8123", "lab-pc.example:8123", "localhost:8123"):
        assert EVERYWHERE.refusal(Asked(host)) is None, host
    assert EVERYWHERE.refusal(Asked("evil.example:8123"))[0] == 421


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "http://localhost:8123",
        "http://127.0.0.1:9999",
        "https://127.0.0.1:8123",
        "http://127.0.0.1:8123.evil.example",
        "null",
        "",
    ],
)
@pytest.mark.parametrize("changes", [False, True])
def test_a_page_of_another_origin_may_not_ask(origin, changes):
    reported = HERE.refusal(Asked("127.0.0.1:8123", origin, changes=changes))
    assert reported[0] == 403


def test_its_own_page_and_a_program_may_ask():
    assert HERE.refusal(Asked("127.0.0.1:8123", "http://127.0.0.1:8123", changes=True)) is None
    assert HERE.refusal(Asked("127.0.0.1:8123", None, changes=True)) is None


def test_another_site_may_lead_a_person_to_the_page_but_embed_nothing():
    opened = Asked("localhost:8123", site="cross-site", mode="navigate", is_page=True)
    assert HERE.refusal(opened) is None
    for site in ("cross-site", "same-site"):
        embedded = Asked("localhost:8123", site=site, mode="no-cors")
        assert HERE.refusal(embedded)[0] == 403
    assert HERE.refusal(Asked("localhost:8123", site="cross-site", mode="navigate"))[0] == 403


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
    assert free.refusal(Asked("127.0.0.1:8123", "http://evil.example"))[0] == 403
    assert free.refusal(Asked("evil.example:8123", "http://evil.example:8123"))[0] == 421


def test_names_in_host_headers():
    assert name_in("[::1]:80") == "::1"
    assert name_in("Lab-PC") == "lab-pc"
    assert name_in("a b") is None


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_an_address_for_all_is_told_as_one_that_leads_here(host):
    reported = ipaddress.ip_address(own_address(host))
    assert not reported.is_unspecified
    with socket.socket(socket.AF_INET if reported.version == 4 else socket.AF_INET6) as here:
        here.bind((str(reported), 0))
