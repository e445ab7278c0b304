"""The table of a live run fits 80 columns, whatever devices call themselves, and loses nothing."""

import io
from collections import Counter

import pytest
from rich.console import Console

from dva_sim.cli import live_screen
from dva_sim.cli.live_screen import Board, InOrder
from dva_sim.live.process import Report

LONG = "Tablet of the night shift, second floor, building seven, gate 12"
DEVICES = [
    {"label": "robot-1", "type": "Robot", "address": "192.168.100.200:65534"},
    {"label": LONG, "type": "Remote Control " * 4, "address": "10.0.0.1:5600"},
    {
        "label": "ipv6",
        "type": "TeleOp",
        "address": "[2001:db8:1234:5678:9abc:def0:1234:5678]:65534",
    },
    {"label": "[bold]markup[/bold]", "type": "TeleOp", "address": "10.0.0.2:5600"},
    {"label": "日本語" * 12, "type": "Robot", "address": "10.0.0.3:5600"},
]
KNOWN = {
    "doing": "Teleoperation",
    "heard_s": 12345.6,
    "beats_hz": 0.5,
    "silent": False,
    "commands_hz": 1000.0,
    "refused": 1234567,
    "picture_age_s": 1234.56,
    "round_trip_s": 27.0,
}


def report(rows, dva=None):
    return Report("dva", 1, 10.0, rows, [], [], {}, False, dva, 0.0)


def printed(board, width):
    out = io.StringIO()
    Console(file=out, width=width).print(board.table())
    return out.getvalue()


@pytest.mark.parametrize("width", [80, 100, 200])
def test_the_table_fits_and_says_all_of_each_device(width):
    board = Board()
    board.hear(report([row | KNOWN for row in DEVICES]))
    text = printed(board, width)
    console = Console(width=width)
    assert all(console.measure(line.rstrip()).maximum <= width for line in text.splitlines())
    letters = "".join(text.split())
    assert "robot-1" in text
    assert "10.0.0.1:5600" in text
    assert "…" not in text
    for number in ("12345.6", "1000.0", "1234567", "1234.56", "27000.0"):
        assert number in text
    for row in DEVICES:
        missing = Counter(row["label"] + row["address"]) - Counter(letters + " " * 99)
        assert not missing


def test_two_hundred_devices_fit():
    board = Board()
    board.hear(report([KNOWN | DEVICES[0] | {"label": f"robot-{n}"} for n in range(200)]))
    lines = printed(board, 80).splitlines()
    assert max(map(len, lines)) <= 80
    assert sum("Robot" in line for line in lines) == 200


def test_where_no_terminal_is_the_table_is_as_wide_as_a_usual_one(monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert live_screen._console().width == 80


def test_where_the_dva_listens_is_said_once_and_before_all_else():
    out = io.StringIO()
    reported = InOrder(Console(file=out, width=80), Board())
    for _ in range(3):
        reported.hear(report([], "127.0.0.1:5600"))
    reported.close()
    assert out.getvalue() == "DVA: 127.0.0.1:5600\n"
