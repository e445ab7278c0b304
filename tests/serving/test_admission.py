"""Requests that a port lets in: by the name asked for, the page that asks, and the token."""

import pytest

from dva_sim.serving.admission import Admission, RequestFacts, name_in, own_names

HERE = own_names("127.0.0.1")
EVERYWHERE = own_names("0.0.0.0", ["Lab-PC.example"])
BRIDGE = own_names("127.0.0.1", any_port=True, programs=("https://app.example", "file://"))


def test_a_local_server_answers_to_the_names_of_this_machine_and_to_no_other():
    for host in ("127.0.0.1", "localhost", "LOCALHOST", "[::1]"):
        for port in ("", ":8123", ":9"):
            assert HERE.refusal(RequestFacts(host + port)) is None, host + port
    others = ["evil.example:8123", "localhost.evil.example", "127.0.0.1.nip.io:8123", "", "::1"]
    others += ["127.0.0.1@evil.example", "10.0.0.7:8123", "[::2]:8123", "[::1", " localhost"]
    for host in (*others, "localhost:8123:1", "localhost:"):
        assert HERE.refusal(RequestFacts(host))[0] == 421, host


def test_served_on_all_addresses_it_answers_to_addresses_and_given_names_only():
    for host in ("10.0.0.7:8123", "[fe80::1]:8123", "lab-pc.example:8123", "localhost:8123"):
        assert EVERYWHERE.refusal(RequestFacts(host)) is None, host
    assert EVERYWHERE.refusal(RequestFacts("evil.example:8123"))[0] == 421


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
    reported = HERE.refusal(RequestFacts("127.0.0.1:8123", origin, changes=changes))
    assert reported[0] == 403


def test_its_own_page_and_a_program_may_ask():
    assert (
        HERE.refusal(RequestFacts("127.0.0.1:8123", "http://127.0.0.1:8123", changes=True)) is None
    )
    assert HERE.refusal(RequestFacts("127.0.0.1:8123", None, changes=True)) is None


def test_another_site_may_lead_a_person_to_the_page_but_embed_nothing():
    opened = RequestFacts("localhost:8123", site="cross-site", mode="navigate", is_page=True)
    assert HERE.refusal(opened) is None
    for site in ("cross-site", "same-site"):
        embedded = RequestFacts("localhost:8123", site=site, mode="no-cors")
        assert HERE.refusal(embedded)[0] == 403
    assert (
        HERE.refusal(RequestFacts("localhost:8123", site="cross-site", mode="navigate"))[0] == 403
    )


def test_a_page_that_another_port_serves_embeds_where_any_port_may():
    names = own_names("127.0.0.1", any_port=True)
    assert names.refusal(RequestFacts("127.0.0.1:8123", site="same-site", mode="no-cors")) is None
    refused = names.refusal(RequestFacts("127.0.0.1:8123", site="cross-site", mode="no-cors"))
    assert refused[0] == 403


@pytest.mark.parametrize(
    ("origin", "status"),
    [
        ("http://localhost:9999", None),
        ("https://app.example", None),
        ("file://", None),
        ("http://app.example", 403),
        ("https://app.example.evil.example", 403),
        ("file://localhost", 403),
        ("null", 403),
        ("", 403),
    ],
)
def test_a_bridge_lets_in_pages_of_this_machine_and_named_programs(origin, status):
    refusal = BRIDGE.refusal(RequestFacts("127.0.0.1:8123", origin, changes=True))
    assert (refusal and refusal[0]) == status


@pytest.mark.parametrize(
    ("query", "bearer", "status"),
    [
        ("token=secret", "", None),
        ("", "Bearer secret", None),
        ("", "", 401),
        ("token=", "", 401),
        ("token=Secret", "", 401),
        ("token=secre\u00e9", "", 401),
        ("token=wrong", "Bearer secret", 401),
    ],
)
def test_a_token_is_shown_in_the_address_or_in_a_header(query, bearer, status):
    refusal = Admission(HERE, "secret").refusal(RequestFacts("localhost"), query, bearer)
    assert (refusal and refusal[0]) == status


def test_without_a_token_names_and_pages_are_still_checked():
    free = Admission(HERE)
    assert free.refusal(RequestFacts("localhost"), "", "") is None
    assert free.refusal(RequestFacts("evil.example"), "", "")[0] == 421
    assert free.refusal(RequestFacts("localhost", "http://evil.example"), "", "")[0] == 403


def test_names_in_host_headers():
    assert name_in("[::1]:80") == "::1"
    assert name_in("Lab-PC") == "lab-pc"
    assert name_in("a b") is None
