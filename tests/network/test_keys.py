"""Key files: made once, kept, checked."""

import os
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest
import zmq
import zmq.auth

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.keys import KeyRing, create_keys

ROBOT, GUARD = "02:00:00:01:00:01", "02:00:00:02:00:01"
PUBLIC = "public/02-00-00-01-00-01.key"
SECRET = "secret/02-00-00-01-00-01.key_secret"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    assert create_keys(tmp_path / "keys", [ROBOT, GUARD]) == [ROBOT, GUARD]
    return tmp_path / "keys"


def mode(file: Path) -> int:
    return stat.S_IMODE(file.stat().st_mode)


def refused(folder: Path, device: str | None = None) -> str:
    """The one line that a broken ring ends in."""
    with pytest.raises(ConfigError) as error:
        KeyRing(folder) if device is None else KeyRing(folder).pair(device)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_keys_survive_writing_and_reading(folder):
    ring = KeyRing(folder)
    assert ring.devices == [ROBOT, GUARD]
    public, secret = ring.pair(ROBOT)
    assert zmq.curve_public(secret) == public == ring.public(ROBOT)
    assert ring.owner(public) == ROBOT
    assert ring.owner(zmq.utils.z85.decode(ring.public(GUARD))) == GUARD
    assert ring.owner(zmq.curve_keypair()[0]) is None


def test_the_files_are_certificates_as_others_read_them(folder):
    assert zmq.auth.load_certificate(folder / SECRET) == KeyRing(folder).pair(ROBOT)
    assert zmq.auth.load_certificate(folder / PUBLIC) == (KeyRing(folder).public(ROBOT), None)


@pytest.fixture
def usual_umask() -> Iterator[None]:
    before = os.umask(0o022)
    yield
    os.umask(before)


@pytest.mark.skipif(os.name != "posix", reason="file modes of POSIX")
def test_public_keys_are_for_all_to_read_and_for_nobody_to_run(usual_umask, tmp_path):
    create_keys(tmp_path, [ROBOT])
    assert mode(tmp_path / PUBLIC) == 0o644
    (tmp_path / PUBLIC).unlink()
    create_keys(tmp_path, [ROBOT])
    assert mode(tmp_path / PUBLIC) == 0o644


@pytest.mark.skipif(os.name != "posix", reason="file modes of POSIX")
def test_secrets_are_for_their_owner_only(folder):
    assert mode(folder / SECRET) == 0o600
    assert mode(folder / "secret") == 0o700
    (folder / SECRET).chmod(0o640)
    assert "chmod 600" in refused(folder, ROBOT)
    KeyRing(folder).pair(GUARD)


def test_existing_keys_are_kept(folder):
    before = KeyRing(folder).pair(ROBOT)
    assert create_keys(folder, [ROBOT, "operator-1"]) == ["operator-1"]
    assert KeyRing(folder).pair(ROBOT) == before


def test_a_public_key_is_made_again_from_its_secret(folder):
    before = KeyRing(folder).pair(ROBOT)
    (folder / PUBLIC).unlink()
    assert create_keys(folder, [ROBOT]) == []
    assert KeyRing(folder).pair(ROBOT) == before


def test_a_folder_can_be_split(folder, tmp_path):
    there = tmp_path / "there"
    shutil.copytree(folder / "public", there / "public")
    (there / "secret").mkdir()
    shutil.copy(folder / SECRET, there / SECRET)
    ring = KeyRing(there)
    assert ring.pair(ROBOT) == KeyRing(folder).pair(ROBOT)
    assert ring.public(GUARD) == KeyRing(folder).public(GUARD)
    assert GUARD in refused(there, GUARD)
    assert create_keys(there, [GUARD]) == []  # its secret is elsewhere


def test_two_devices_cannot_have_one_key(folder):
    text = (folder / PUBLIC).read_text()
    (folder / "public" / "copy.key").write_text(text)
    assert ROBOT in refused(folder)
    (folder / "public" / "copy.key").write_text(text.replace(ROBOT, "robot-9"))
    assert "copy.key" in refused(folder)


def test_a_secret_does_not_belong_among_the_public_keys(folder):
    shutil.copy(folder / SECRET, folder / PUBLIC)
    assert PUBLIC in refused(folder)


def test_keys_that_are_no_pair_are_refused(folder, tmp_path):
    create_keys(tmp_path / "other", [ROBOT])
    shutil.copy(tmp_path / "other" / SECRET, folder / SECRET)
    assert "outdated" in refused(folder, ROBOT)
    shutil.copy(folder / "secret" / "02-00-00-02-00-01.key_secret", folder / SECRET)
    assert GUARD in refused(folder, ROBOT)
    text = (tmp_path / "other" / SECRET).read_text()
    stranger = zmq.curve_keypair()[0].decode()
    public = KeyRing(tmp_path / "other").public(ROBOT).decode()
    (folder / SECRET).write_text(text.replace(public, stranger))
    assert "do not match" in refused(folder, ROBOT)
