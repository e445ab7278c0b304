"""Accelerometer logs as logger apps export them."""

import json
import math

import numpy as np
import pytest
from helpers.processes.command_line import call
from helpers.wording import unnamed

from dva_sim.agents.tilt.accelerometer import GRAVITY
from dva_sim.recordings.sensor_log import read_sensor_log

RATE, LASTS = 100.0, 100
XYZ = (-0.1, 0.3, 9.78)  # [m/s^2]


def rows(time=1.0, start=0.0, axes=1.0, order=(0, 1, 2), sign="."):
    """Lines of numbers: a time in some unit, and the axes in some other."""
    for n in range(LASTS):
        values = [start + n / RATE * time, *(XYZ[axis] * axes for axis in order)]
        yield [f"{value:.9g}".replace(".", sign) for value in values]


def log_of(folder, head, lines, delimiter=","):
    text = "\n".join(delimiter.join(words) for words in ([head] if head else []) + list(lines))
    (folder / "log.csv").write_text(text + "\n", encoding="utf-8")
    return folder / "log.csv"


LOGS = {
    "plain": (["t", "x", "y", "z"], list(rows()), ","),
    "no head": ([], list(rows()), ","),
    "semicolons and decimal commas": (["t", "x", "y", "z"], list(rows(sign=",")), ";"),
    "tabs": (["Time", "X", "Y", "Z"], list(rows()), "\t"),
    "in g": (["t", "x", "y", "z"], list(rows(axes=1 / GRAVITY)), ","),
    "g by its head": (["time (s)", "gFx", "gFy", "gFz"], list(rows(axes=1 / GRAVITY)), ","),
    "units in the head": (
        [f'"{name}"' for name in ("Time (s)", *(f"Acceleration {a} (m/s^2)" for a in "xyz"))],
        list(rows()),
        ",",
    ),
    "milliseconds": (["timestamp", "accX", "accY", "accZ"], list(rows(time=1e3)), ","),
    "epoch in milliseconds": (["time_ms", "ax", "ay", "az"], list(rows(1e3, 1.7e12)), ","),
    "two times and other order": (
        ["time", "seconds_elapsed", "z", "y", "x"],
        [[f"{1_700_000_000_000_000_000 + 10_000_000 * n}", *row]
         for n, row in enumerate(rows(order=(2, 1, 0)))],
        ",",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", LOGS)
def test_a_log_is_read_in_seconds_and_metres(tmp_path, kind):
    head, lines, delimiter = LOGS[kind]
    samples, _ = read_sensor_log(log_of(tmp_path, head, lines, delimiter))
    assert len(samples) == LASTS
    assert samples[0].stamp == 0.0
    if kind != "epoch in milliseconds":  # of which nine digits are seconds
        steps = np.diff([sample.stamp for sample in samples])
        assert steps == pytest.approx(1 / RATE, rel=1e-6)
    assert samples[-1].xyz == pytest.approx(XYZ, rel=1e-6)


@pytest.mark.parametrize(
    ("head", "axes", "guesses"),
    [
        (["t", "x", "y", "z"], 1.0, ["times in s", "0.01 apart", "m/s2", "9.79"]),
        (["t (s)", "x", "y", "z"], 1 / GRAVITY, ["in g", "0.998"]),
        (["t (s)", "accX (g)", "accY (g)", "accZ (g)"], 1 / GRAVITY, []),
    ],
)
def test_what_was_guessed_is_said_with_its_reason(tmp_path, head, axes, guesses):
    file = log_of(tmp_path, head, rows(axes=axes))
    log = read_sensor_log(file)
    assert bool(log.guesses) is bool(guesses)
    assert unnamed(" ".join(log.guesses), *guesses) == []
    assert call("phone-log", file).stdout.count("guessed: ") == len(log.guesses)
    assert json.loads(call("phone-log", file, "--json").stdout)["guesses"] == list(log.guesses)


def test_a_unit_that_is_given_is_taken_if_gravity_allows(tmp_path):
    file = log_of(tmp_path, ["t", "x", "y", "z"], rows(axes=0.7))
    assert read_sensor_log(file, "m/s2").samples[0].xyz[2] == pytest.approx(XYZ[2] * 0.7)


def turning(size, hertz, lift=0.0, ripple=0.0):
    """Rows of a vector that turns about x, on top of a steady one."""
    for n in range(3 * LASTS):
        angle = 2 * math.pi * hertz * n / RATE
        length = size * (1 + ripple * (-1) ** n)
        yield [
            f"{n / RATE}",
            "0",
            f"{length * math.cos(angle)}",
            f"{lift + length * math.sin(angle)}",
        ]


@pytest.mark.parametrize("lines", [turning(9.8, 0.1, ripple=0.001), turning(1.0, 1.8, lift=9.8)])
def test_a_log_of_gravity_and_more_is_taken(tmp_path, lines):
    file = log_of(tmp_path, ["t", "x", "y", "z"], lines)
    assert len(read_sensor_log(file).samples) == 3 * LASTS


def test_columns_with_gravity_are_taken_before_those_without(tmp_path):
    head = ["t", *(f"userAcceleration{a}" for a in "XYZ"), *(f"accelerometer{a}" for a in "XYZ")]
    lines = [[row[0], "0", "0", "0", *row[1:]] for row in rows()]
    assert read_sensor_log(log_of(tmp_path, head, lines)).samples[0].xyz == pytest.approx(XYZ)


def test_the_command_tells_a_log_and_makes_a_part_of_it_but_no_commands(tmp_path):
    file = log_of(tmp_path, ["t", "x", "y", "z"], rows(axes=1 / GRAVITY))
    output = json.loads(call("phone-log", file, "--json").stdout)
    assert output["rate_hz"] == pytest.approx(RATE)
    assert output["late_ms"] is None
    assert call("phone-log", file, "--part", tmp_path / "part.yaml", "--unit", "g").returncode == 0
    assert call("check", tmp_path / "part.yaml").returncode == 0
    refused = call("phone-log", file, "--commands")
    assert refused.returncode == 2
    assert unnamed(refused.stderr, "log.csv", "app") == []
