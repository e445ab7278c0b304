"""What a live run prints."""

from dataclasses import replace
from io import StringIO

from rich.console import Console

from dva_sim.cli.live_screen import Board, InOrder
from dva_sim.live.process import Report


def report(part: str, time: float, *story: float) -> Report:
    lines = [[when, part, f"at {when:g}", "event"] for when in story]
    return Report(part, 1, time, [], [], lines, {}, False, None, 0.0)


def test_lines_of_several_parts_are_printed_in_order_of_time_whoever_reports_first() -> None:
    said = StringIO()
    told = InOrder(Console(file=said, width=80), Board())
    told.hear(report("world", 3.0, 2.6, 2.9))
    told.hear(report("dva", 3.4, 2.5, 2.7))
    assert said.getvalue() == ""  # something earlier may still come
    told.hear(report("world", 4.8, 4.0))
    assert [line.split()[-1] for line in said.getvalue().splitlines()] == ["2.5", "2.6", "2.7"]
    told.close()
    told.close()
    assert [line.split()[-1] for line in said.getvalue().splitlines()[3:]] == ["2.9", "4"]


def test_the_last_lines_of_the_story_are_the_latest() -> None:
    board = Board()
    board.hear(report("world", 3.0, 2.6))
    board.hear(report("dva", 3.4, 2.5))
    assert [line.split()[-1] for line in str(board.lines_of_story()).splitlines()] == ["2.5", "2.6"]


def test_a_device_that_the_dva_has_forgotten_is_shown_no_longer() -> None:
    board, row = Board(), {"label": "robot-1", "type": "Robot", "address": "10.0.0.1"}
    rows = [row, row | {"label": "passes by"}]
    board.hear(replace(report("dva", 1.0), rows=rows))
    board.hear(replace(report("world", 1.0), rows=[{"label": "guard-1", "doing": "waiting"}]))
    board.hear(replace(report("dva", 2.0), rows=[row]))
    assert set(board.devices) == {"robot-1", "guard-1"}
