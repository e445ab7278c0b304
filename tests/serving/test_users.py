"""Users in a file: kept as hashes, for their owner alone, and refused in one line."""

import json
import stat
from pathlib import Path

import pytest
from helpers.mistakes import check_mistake, each_mistake, mistakes

from dva_sim.serving.users import MAX_BYTES, UserFile, is_password_of

PASSWORD = "correct horse"


@pytest.fixture
def users(tmp_path):
    kept = UserFile(tmp_path / "users.json")
    kept.add("ana", "supervise", PASSWORD)
    return kept


def test_a_user_is_kept_without_the_password_for_the_owner_of_the_file_alone(users):
    text = users.path.read_text()
    assert PASSWORD not in text
    assert stat.S_IMODE(users.path.stat().st_mode) == 0o600
    assert UserFile(users.path).users == users.users


def test_the_password_and_no_other_is_that_of_the_user(users):
    ana = users.find("ana")
    assert is_password_of(ana, PASSWORD)
    assert not is_password_of(ana, PASSWORD.upper())
    assert not is_password_of(None, PASSWORD)


def test_a_user_is_changed_locked_and_removed(users):
    before = users.find("ana").password
    users.change("ana", role="look")
    users.change("ana", locked=True)
    again = UserFile(users.path).find("ana")
    assert (again.role, again.locked, again.password) == ("look", True, before)
    users.change("ana", locked=False, password="another horse")
    assert is_password_of(UserFile(users.path).find("ana"), "another horse")
    users.remove("ana")
    assert UserFile(users.path).users == {}


HASH = "$argon2id$v=19$m=65536,t=3,p=4$jdlNni01KYGLybqoucCjCQ$CwjhY/taxjJLGiTf9xCvTjKSgtipxeFTwAwG"
ENTRY = {"name": "bo", "role": "look", "password": HASH}


def entries(*some):
    return json.dumps({"users": list(some)})


def read(text):
    path = Path("users.json")
    path.write_text(text)
    UserFile(path)


def add(name, role, password):
    users = UserFile(Path("users.json"))
    users.add("ana", "look", PASSWORD)
    users.add(name, role, password)


MISTAKES = [
    *mistakes(
        read,
        ("{", "users.json JSON"),
        ("{}", "users.json list"),
        ("[]", "users.json list"),
        (entries(1), "users.json entry"),
        (entries(ENTRY | {"name": ""}), "entry name role"),
        (entries(ENTRY | {"role": "king"}), "entry role"),
        (entries(ENTRY | {"more": 1}), "entry"),
        (entries(ENTRY | {"password": None}), "entry password"),
        (entries(ENTRY | {"password": "plain"}), "entry password hash"),
        (entries(ENTRY | {"password": HASH.replace("65536", "4294967295")}), "entry password hash"),
        (entries(ENTRY | {"password": HASH.replace("t=3", "t=4000")}), "entry password hash"),
        (entries(ENTRY, ENTRY), "two same name"),
        (" " * (MAX_BYTES + 1), "too long"),
    ),
    *mistakes(
        add,
        ("", "look", PASSWORD, "name 1 to 40"),
        ("<b>", "look", PASSWORD, "name 1 to 40"),
        ("ana", "look", PASSWORD, "'ana' already"),
        ("bo", "king", PASSWORD, "'king' look supervise"),
        ("bo", "look", "short", "password 8 to 200"),
        ("bo", "look", "x" * 201, "password 8 to 200"),
    ),
    *mistakes(lambda name: UserFile(Path("users.json")).remove(name), ("bo", "'bo'")),
]


@each_mistake(MISTAKES)
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
