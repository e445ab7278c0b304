"""Reports of people with a phone: by the phone's own device, at a place on the map."""

import pytest
from helpers.console.simulated_phone import FIRE, PhonePage


@pytest.fixture
def phone(monkeypatch: pytest.MonkeyPatch) -> PhonePage:
    later = [FIRE[0] | {"at_s": 900, "latest_s": 900}]
    return PhonePage(monkeypatch, client="c1", bystander__count=0, events=later)


WHERE = {"kind": "gas_leak", "severity": "high", "x_m": 20.0, "y_m": 12.0}


def test_a_registered_phone_reports_what_its_person_sees(phone):
    assert phone.register()["ok"]
    done = phone.ask("phone_report", **WHERE)
    assert done["ok"]
    phone.let(1.0)
    (event,) = phone.lines_of("events")[-1]["events"]
    assert (event["number"], event["kind"]) == (done["event"], "gas_leak")
    assert (event["x_m"], event["y_m"]) == pytest.approx((20.0, 12.0), abs=0.05)


def test_a_phone_that_is_not_registered_reports_nothing(phone):
    done = phone.ask("phone_report", **WHERE)
    assert not done["ok"]
    assert "Register" in done["text"]


def test_a_place_beyond_the_site_is_refused(phone):
    assert phone.register()["ok"]
    assert not phone.ask("phone_report", **WHERE | {"x_m": 1000.0})["ok"]
