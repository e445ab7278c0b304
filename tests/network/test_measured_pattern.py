"""Commands that leave and arrive when others did over real middleware."""

import gzip
import itertools
import os
import runpy
from pathlib import Path

import pytest
from helpers.network.transports import DELAY, PHONE, ROBOT, VirtualWorld

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.measured_commands import measured_runs
from dva_sim.network.patterns import load_pattern
from dva_sim.testing.patterns import TriedDrive

ROOT = Path(__file__).parents[2]
NAME = "measured.py:Measured"
HEAD = "middleware,link,made_s,arrived_s\n"
ROWS = """\
brokered,far,0.0,0.3
brokered,far,0.1,0.4
brokered,far,0.2,
brokered,far,0.3,0.9
brokered,far,0.4,0.8
brokered,far,0.5,1.0
direct,far,0.0,0.01
direct,far,0.05,0.06
"""


@pytest.fixture
def table(tmp_path):
    file = tmp_path / "commands.csv"
    file.write_text(HEAD + ROWS)
    return file


def driven(options, lasts, begins=0.0):
    """A drive at 20 commands a second: when each command was sent [s], and the drive."""
    world = VirtualWorld()
    drive = TriedDrive(world.network, load_pattern(NAME, options)(), node=PHONE, robot=ROBOT)
    drive.rate_hz = 20.0
    began = world.clock.now + begins
    world.run_until(lambda: world.clock.now >= began)
    drive.begin()
    world.run_until(lambda: world.clock.now >= began + lasts)
    drive.end()
    world.run_until(lambda: world.clock.now >= began + lasts + 5.0)
    assert drive.wrong == []
    return [when for _, when in drive.sent], drive


def phases(options, lasts):
    """Times of commands within what was measured, whatever round they came in [s]."""
    times, drive = driven(options, lasts)
    length, start = drive.pattern.length, drive.pattern.start
    assert len(times) > lasts / length  # more than one in each round
    return sorted({round((when - start) % length, 6) for when in times})


def test_commands_arrive_when_those_that_were_measured_did(table):
    # of six, one never arrived and one after a newer one
    options = {"file": str(table), "where": {"middleware": "brokered"}}
    assert phases(options, 6.0) == [0.3, 0.4, 0.8, 1.0]


def test_of_a_window_what_arrived_in_it_counts(table):
    options = {"file": str(table), "where": {"middleware": "brokered"}, "window_s": [0.35, 0.85]}
    assert phases(options, 4.0) == [0.05, 0.45]


def test_what_was_measured_is_repeated_as_long_as_a_drive_lasts(table):
    options = {"file": str(table), "where": {"middleware": "direct"}, "window_s": [0, 0.1]}
    times, drive = driven(options, 10.0)
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert gaps == pytest.approx([0.05] * len(gaps))
    assert len(times) > 190
    took = [b - a for (_, a), (_, b) in zip(drive.sent, drive.applied, strict=True)]
    assert min(took) >= DELAY  # of the modelled link, which comes on top


def test_a_drive_begins_anywhere_but_at_the_same_place_over_each_middleware(tmp_path):
    file = tmp_path / "commands.csv"
    rows = [f"{late},{at / 10},{at / 10 + late}" for late in (0.02, 0.05) for at in range(100)]
    file.write_text("\n".join(("late,made_s,arrived_s", *rows, "")))

    def place(late, begins):
        options = {"file": str(file), "where": {"late": late}, "window_s": [0, 10]}
        _, drive = driven(options, 1.0, begins)
        return (begins - drive.pattern.start) % drive.pattern.length

    places = [place(0.02, begins) for begins in range(20)]
    assert places == [place(0.05, begins) for begins in range(20)]
    assert min(places) < 2.0 < 8.0 < max(places)


def test_runs_follow_each_other_and_are_not_mixed(tmp_path):
    file = tmp_path / "commands.csv"
    rows = [f"{person},{5 + at},{5 + at + late}" for person, late in ((0, 0.1), (1, 0.3))
            for at in (0.0, 1.0)]  # fmt: skip
    file.write_text("\n".join(("person,made_s,arrived_s", *rows, "")))
    assert phases({"file": str(file), "window_s": [5, 7]}, 12.0) == [0.1, 1.1, 2.3, 3.3]


def test_a_table_may_be_compressed(table):
    file = table.with_suffix(".csv.gz")
    file.write_bytes(gzip.compress(table.read_bytes()))
    options = {"where": {"middleware": "direct"}}
    plain, packed = (driven({"file": str(each), **options}, 2.0)[0] for each in (table, file))
    assert plain == packed
    assert len(plain) > 30


def test_a_command_may_take_no_time_but_not_less(table):
    table.write_text(HEAD + "direct,far,0.5,0.5\n")
    assert measured_runs(table, {}) == [((0.5, 0.5),)]
    table.write_text(HEAD + "direct,far,0.5,0.4999\n")
    with pytest.raises(ConfigError, match="arrived earlier"):
        measured_runs(table, {})


def test_a_run_in_which_nothing_arrived_is_silence_of_its_length(tmp_path):
    file = tmp_path / "commands.csv"
    rows = [f"{person},{at},{at + 0.1 if person else ''}" for person in (0, 1) for at in (0, 1, 2)]
    file.write_text("\n".join(("person,made_s,arrived_s", *rows, "")))
    assert phases({"file": str(file), "window_s": [0, 3]}, 18.0) == [3.1, 4.1, 5.1]
    silent = {"file": str(file), "where": {"person": 0}}
    assert driven(silent, 9.0)[0] == []


def test_without_any_connection_nothing_arrives(tmp_path):
    file = tmp_path / "commands.csv"
    file.write_text("link,person,made_s,arrived_s\nshut,0,,\nodd,0,,\nodd,1,0,0.1\nodd,1,1,1.1\n")
    assert driven({"file": str(file), "where": {"link": "shut"}}, 3.0)[0] == []
    assert phases({"file": str(file), "where": {"link": "odd"}}, 6.0) == [0.1, 1.1]


def test_a_table_that_is_written_again_is_read_again(table):
    options = {"file": str(table), "where": {"middleware": "brokered"}, "window_s": [0, 2]}
    assert phases(options, 6.0) == [0.3, 0.4, 0.8, 1.0]
    before = table.stat().st_mtime_ns
    table.write_text(HEAD + ROWS.replace("0.0,0.3", "0.0,0.35"))
    os.utime(table, ns=(before + 1, before + 1))
    assert phases(options, 6.0) == [0.35, 0.4, 0.8, 1.0]


def test_what_is_under_way_when_a_drive_ends_is_lost(table):
    began = VirtualWorld().clock.now
    times, _ = driven({"file": str(table), "where": {"middleware": "brokered"}}, 2.0)
    assert len(times) > 0
    assert max(times) <= began + 2.0


def test_the_shipped_table_is_made_of_what_a_study_exports(tmp_path):
    make = runpy.run_path(str(ROOT / "experiments/traces/make_commands.py"))
    (tmp_path / "runs.csv").write_text("middleware,link,person\nudp,far,1\nudp,far,0\ndds,far,0\n")
    (tmp_path / "commands.csv").write_text(
        "middleware,link,person,made_s,arrived_s\n"
        "udp,far,1,0.5,0.65001\nudp,far,1,0.4,\nudp,far,0,0.123456,0.3\n"
    )
    file = tmp_path / "made.csv.gz"
    file.write_bytes(make["packed"](tmp_path))
    lines = gzip.decompress(file.read_bytes()).decode().splitlines()
    assert lines[1:] == [
        "dds,far,0,,",
        "udp,far,0,0.1235,0.3000",
        "udp,far,1,0.4000,",
        "udp,far,1,0.5000,0.6500",
    ]
    found = measured_runs(file, {"link": "far", "middleware": "udp"})
    assert [len(run) for run in found] == [1, 2]
    assert measured_runs(file, {"middleware": "dds"}) == [()]
