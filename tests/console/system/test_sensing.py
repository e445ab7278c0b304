"""Sensor values at an attached console: of robots that somebody looks at, as the DVA permits."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.console.remote_console import OWN, RemotePage, attached

from dva_sim.console.system.sensing import RENEW
from dva_sim.protocol.mistakes import check_message

pytestmark = pytest.mark.system


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[RemotePage]:
    with attached(monkeypatch, tmp_path, role="look") as one:
        one.until(lambda: readings(one))
        yield one


def robot_1(page: RemotePage) -> int:
    return page.system.numbers[page.world.robot().device.id_tag]


def readings(page: RemotePage) -> dict[str, str]:
    """Sensor readings of the first robot on the page."""
    rows = {row["i"]: row["sensors"] for row in page.lines_of("rows")[-1]["robots"]}
    return dict(one.split(" ", 1) for one in rows.get(robot_1(page), ()))


def look(page: RemotePage, *robots: int) -> None:
    page.actions.take({"do": "watch", "robots": list(robots)})


def test_what_nobody_looks_at_is_unknown(page):
    page.let(5.0)

    assert set(readings(page).values()) == {"unknown"}
    assert OWN not in page.world.robot().controller.observers


def test_values_come_while_somebody_looks_and_end_with_that(page):
    look(page, robot_1(page))
    page.until(lambda: "unknown" not in readings(page).values())
    shown = readings(page)
    assert shown["temperature"].endswith(" degC")
    assert shown["lidar"].startswith("nearest ")
    assert 0.0 < float(shown["battery"]) <= 1.0

    look(page)
    page.let(2.0)
    assert set(readings(page).values()) == {"unknown"}
    assert OWN not in page.world.robot().controller.observers
    sent = [data for source, _, data in page.world.heard if source == OWN]
    assert [
        found for data in sent if isinstance(data, bytes) for found in check_message(data)
    ] == []


def test_values_go_on_beyond_what_a_subscription_lasts_for(page):
    look(page, robot_1(page))
    page.let(5 * RENEW)

    assert "unknown" not in readings(page).values()


def test_a_value_that_does_not_come_any_more_is_unknown(page):
    look(page, robot_1(page))
    page.until(lambda: "unknown" not in readings(page).values())
    page.world.world.run.network.leave(page.world.robot().device.id_tag)
    page.let(15.0)

    assert set(readings(page).values()) == {"unknown"}


def test_only_what_the_dva_permits_is_shown(monkeypatch, tmp_path):
    rules = [{"levels": ["sensors"], "sensors": ["temperature"]}]
    with attached(monkeypatch, tmp_path, access=rules) as page:
        page.until(lambda: readings(page))
        look(page, robot_1(page))
        page.until(lambda: readings(page)["temperature"] != "unknown")
        page.let(5.0)
        known = {name for name, value in readings(page).items() if value != "unknown"}
        assert known == {"temperature"}


def test_whoever_looks_before_the_sensors_are_known_gets_their_values_too(monkeypatch, tmp_path):
    with attached(monkeypatch, tmp_path) as page:
        page.until(lambda: page.world.robot().device.id_tag in page.system.numbers)
        assert readings(page) == {}
        look(page, robot_1(page))
        page.until(lambda: readings(page) and "unknown" not in readings(page).values())
