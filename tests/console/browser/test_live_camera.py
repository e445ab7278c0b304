"""A browser shows the camera of a live run's robot by nothing but an image element."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.processes.programs import Programs, all_gone_after


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Programs]:
    yield from all_gone_after(tmp_path)


def test_an_image_element_shows_what_a_robot_of_a_live_run_sees(programs, browser):
    run = programs.start("live", "drive-to-event", "--camera-port", "0")
    run.wait_to_say("shows pictures of the robots at http://")
    url = re.search(r"at (http://127\.0\.0\.1:\d+/camera/)LABEL", run.said)
    assert url is not None
    page = browser.new_page()
    page.set_content(f'<img src="{url[1]}robot-1.mjpg">', wait_until="commit")
    page.wait_for_function("document.images[0].naturalWidth === 320")
    page.close()
