"""Keys by the names that people use, and what both ends say when keys do not fit."""

import shutil
from pathlib import Path

import pytest
from helpers.processes.command_line import call
from helpers.processes.programs import Program, Programs
from helpers.wording import unnamed

from dva_sim.cli.device_keys import make_keys
from dva_sim.network.keys import KeyRing
from dva_sim.simulation.full.stage import DVA, id_of

ROBOT, OPERATOR, DETECTOR = (id_of(kind, 1) for kind in ("robot", "operator", "detector"))


# --- who gets keys -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "id_tag"),
    [
        ("dva", "02:00:00:00:00:01"),
        ("robot-1", "02:00:00:01:00:01"),
        ("guard-7", "02:00:00:02:00:07"),
        ("operator-2", "02:00:00:03:00:02"),
        ("detector-300", "02:00:00:04:01:2C"),
        ("70:1A:04:F9:81:D6", "70:1A:04:F9:81:D6"),
    ],
)
def test_a_device_is_named_as_people_do_or_by_its_id(tmp_path, name, id_tag):
    assert unnamed(make_keys(tmp_path / "keys", [name]), tmp_path / "keys", "made 1 ") == []
    ring = KeyRing(tmp_path / "keys")
    assert ring.devices == [id_tag]
    assert len(ring.pair(id_tag)[1]) == 40


def test_a_scenario_stands_for_all_its_devices(tmp_path):
    make_keys(tmp_path, ["drive-to-event"])
    assert KeyRing(tmp_path).devices == sorted([DVA, ROBOT, OPERATOR, DETECTOR])


def test_keys_that_are_there_are_kept(tmp_path):
    make_keys(tmp_path, ["robot-1", "robot-2"])
    before = KeyRing(tmp_path).pair(ROBOT)
    reported = make_keys(tmp_path, ["drive-to-event", "robot-1", "dva"])
    assert unnamed(reported, tmp_path, "made 3 ", " 1 were there") == []
    assert KeyRing(tmp_path).pair(ROBOT) == before


# --- live ----------------------------------------------------------------------------------

LIVE = ("live", "drive-to-event", "--operators", "scripted", "--set", "robot.processing_s=0")


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    folder = tmp_path / "keys"
    make_keys(folder, ["drive-to-event"])
    return folder


@pytest.mark.system
def test_a_run_with_keys_goes_like_one_without(programs, tmp_path):
    made = call("keys", "ours", "drive-to-event", cwd=tmp_path)
    assert (made.returncode, unnamed(made.stdout, "ours", "made 4 ")) == (0, [])
    run = programs.start(*LIVE, "--keys", "ours")
    assert run.ends() == 0, run.complained
    assert unnamed(run.output, "mode Teleoperation", "(the script is done)") == []
    assert unnamed(run.output, "handshake", "refused a connection") == [
        "handshake",
        "refused a connection",
    ]


def with_another_key(keys: Path, device: str) -> Path:
    """A copy of a folder in which one device has another pair."""
    other = keys.with_name("other")
    shutil.copytree(keys, other)
    stem = device.replace(":", "-")
    (other / "public" / f"{stem}.key").unlink()
    (other / "secret" / f"{stem}.key_secret").unlink()
    make_keys(other, [device])
    return other


def dva_and_operator(
    programs: Programs, address: str, *folders: Path | None
) -> tuple[Program, Program]:
    """Both started by hand, each with its own folder of keys, or with none."""
    options = [("--keys", folder) if folder else () for folder in folders]
    dva, operator = (
        programs.start(*LIVE, "--only", part, "--dva", address, *keys)
        for part, keys in zip(("dva", "operator"), options, strict=True)
    )
    return dva, operator


@pytest.mark.system
def test_an_operator_whose_key_is_unknown_is_told_so_at_both_ends(programs, address, keys):
    theirs = with_another_key(keys, OPERATOR)
    dva, operator = dva_and_operator(programs, address, keys, theirs)
    dva.wait_to_say(f"{DVA} refused a connection: an unknown key (")
    operator.wait_to_say(f"{OPERATOR}: handshake with {DVA} at tcp://{address} failed: ")
    operator.wait_to_say(f"{DVA} does not know the key of {OPERATOR}")


@pytest.mark.system
def test_an_operator_without_keys_is_told_so_at_both_ends(programs, address, keys):
    dva, operator = dva_and_operator(programs, address, keys, None)
    dva.wait_to_say("the other end has no keys, this one wants them")
    operator.wait_to_say(f"{DVA} wants keys, this end has none")


@pytest.mark.system
def test_a_missing_secret_key_ends_in_one_line(programs, keys):
    (keys / "secret" / f"{OPERATOR.replace(':', '-')}.key_secret").unlink()
    run = programs.start(*LIVE, "--for", "60", "--keys", keys)
    assert run.ends() == 2
    (line,) = run.complained
    assert OPERATOR in line
    assert programs.processes() == {}
