"""Commands that leave and arrive when others did over real middleware."""

import itertools

import pytest
from helpers.network.transports import DELAY, PHONE, ROBOT, VirtualWorld
from helpers.wording import unnamed

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.patterns import load_pattern
from dva_sim.testing.patterns import TriedDrive

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


def driven(options, lasts):
    """A drive at 20 commands a second: when each command was made, sent and applied [s]."""
    world = VirtualWorld()
    drive = TriedDrive(world.network, load_pattern(NAME, options)(), node=PHONE, robot=ROBOT)
    drive.rate_hz = 20.0
    began = world.clock.now
    drive.begin()
    world.run_until(lambda: world.clock.now >= began + lasts)
    drive.end()
    world.run_until(lambda: world.clock.now >= began + lasts + 5.0)
    assert drive.wrong == []
    return [when - began for _, when in drive.sent], drive


def test_commands_arrive_when_those_that_were_measured_did(table):
    times, _ = driven({"file": str(table), "where": {"middleware": "brokered"}}, 2.0)
    # of six, one never arrived and one after a newer one; nothing has been made for the first, and
    # the last of a round comes after the first of the next
    assert times[:3] == pytest.approx([0.4, 0.8, 2 / 3 + 0.3], abs=1e-6)


def test_what_was_measured_is_repeated_as_long_as_a_drive_lasts(table):
    times, drive = driven({"file": str(table), "where": {"middleware": "direct"}}, 10.0)
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert gaps == pytest.approx([0.05] * len(gaps))
    assert len(times) > 190
    took = [b - a for (_, a), (_, b) in zip(drive.sent, drive.applied, strict=True)]
    assert min(took) >= DELAY  # of the modelled link, which comes on top


def test_runs_follow_each_other_and_are_not_mixed(tmp_path):
    file = tmp_path / "commands.csv"
    rows = [f"{person},{5 + at},{5 + at + late}" for person, late in ((0, 0.1), (1, 0.3))
            for at in (0.0, 1.0)]  # fmt: skip
    file.write_text("\n".join(("person,made_s,arrived_s", *rows, "")))
    times, _ = driven({"file": str(file)}, 6.0)
    # at 0 s nothing has been made yet
    assert times == pytest.approx([1.1, 2.3, 3.3, 4.1, 5.1], abs=1e-6)


def test_what_is_under_way_when_a_drive_ends_is_lost(table):
    times, _ = driven({"file": str(table), "where": {"middleware": "brokered"}}, 0.5)
    assert max(times, default=0.0) <= 0.5


@pytest.mark.parametrize(
    ("text", "where", "names"),
    [
        (HEAD + ROWS, {"middleware": "carrier pigeon"}, ("middleware carrier pigeon", "fewer")),
        (HEAD + ROWS, {"transport": "x"}, ("transport",)),
        ("made_s\n1\n", {}, ("arrived_s",)),
        (HEAD + "a,b,soon,later\n", {}, ("soon",)),
        ("", {}, ("made_s", "arrived_s")),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_in_a_line(tmp_path, text, where, names):
    file = tmp_path / "commands.csv"
    file.write_text(text)
    with pytest.raises(ConfigError, match=r".") as caught:
        load_pattern(NAME, {"file": str(file), "where": where})()
    assert unnamed(str(caught.value), "commands.csv", *names) == []
    assert "\n" not in str(caught.value)
