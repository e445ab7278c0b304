"""The example of docs/link.md, as it stands there."""

import csv
import re
import shlex

import pytest
from helpers.paths import ROOT

pytestmark = pytest.mark.system

PAGE = (ROOT / "docs/link.md").read_text(encoding="utf-8")


def test_the_example_of_the_page_does_what_the_page_says(programs, tmp_path):
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    names = ("robot.py", "drive.py", "bad.yaml")
    for name, (_, text) in zip(names, blocks, strict=False):
        assert f"`{name}`" in PAGE
        (tmp_path / name).write_text(text)
    command, live = (text for language, text in blocks if not language)
    assert live.startswith("dva-sim live drive-to-event --link bad.yaml")
    program = programs.start(*shlex.split(command)[1:])
    assert program.ends() == 0, program.complained
    times = re.findall(r"command (\d): ([\d.]+) s", program.said)
    assert [int(number) for number, _ in times] == list(range(5))
    assert all(float(time) >= 0.2 for _, time in times)
    with (tmp_path / "counts.csv").open(newline="") as file:
        there, back = csv.DictReader(file)
    assert int(there["passed_packets"]) >= 5 <= int(back["passed_packets"])
