"""Goals by the clock, one after the other: `make goals`, or some of them by `-k`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from benchmarks import (
    checker_cost,
    console_page,
    crowd,
    emergency_flood,
    link_rate,
    load,
    phone_page,
    two_processes,
    vanishing_devices,
)

MEASURES = (
    crowd.a_thousand_robots,
    two_processes.two_processes,
    checker_cost.runs,
    checker_cost.storms,
    link_rate.packets_in_time,
    load.devices_at_a_dva,
    vanishing_devices.waves_of_devices_that_vanish,
    emergency_flood.stop_at_the_console,
    emergency_flood.stop_at_a_phone,
    console_page.from_a_key_to_the_set_point,
    console_page.from_the_command_to_the_drawn_map,
    console_page.a_page_of_ten_robots,
    console_page.a_page_of_two_hundred_robots,
    console_page.cpu_of_each_process,
    phone_page.from_the_hand_to_the_set_point,
    phone_page.two_phones,
    phone_page.twenty_phones,
    phone_page.from_sensor_and_camera_in_a_browser,
)


@pytest.mark.parametrize("measure", MEASURES, ids=lambda measure: measure.__name__)
def test_goals_are_measured(measure: Callable[[Path], None], tmp_path: Path) -> None:
    """Print missed goals; only a measurement that cannot be made fails."""
    measure(tmp_path)
