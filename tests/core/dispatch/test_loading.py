"""Policies by name, by file, and from installed packages."""

from importlib.metadata import EntryPoint, EntryPoints

import pytest
from helpers.dva.dispatch_situations import RNG, situation

from dva_sim.core.dispatch import POLICIES, MinEta, Policy, known_policies, load_policy
from dva_sim.kernel import plugins
from dva_sim.kernel.errors import ConfigError

MINE = """
from dva_sim.core.dispatch import Assignment, Policy

class Mine(Policy):
    def __init__(self, pace: float = 1.0) -> None:
        self.pace = 2 / pace
    def advise(self, situation, rng):
        return [Assignment(0, 1)]
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(MINE)
    return tmp_path


@pytest.mark.parametrize("name", sorted(POLICIES.keys() - {"oracle"}))
def test_every_name_makes_a_policy(name):
    assert isinstance(load_policy(name, {}), Policy)
    assert name in known_policies()


def test_a_class_in_a_file_is_found_beside_who_names_it_and_in_the_working_folder(folder):
    assert load_policy("mine.py:Mine", {"pace": 4}).pace == 0.5
    (folder / "sub").mkdir()
    (folder / "sub" / "mine.py").write_text(MINE.replace("2 / pace", "9"))
    assert load_policy("mine.py:Mine", base=folder / "sub").pace == 9
    advice = load_policy("mine.py:Mine").advise(situation("gg", [[1, 2]]), RNG)
    assert advice[0].responder == 1


def test_two_files_of_one_name_do_not_meet_and_a_changed_one_is_read_again(folder):
    other = folder / "other"
    other.mkdir()
    (other / "mine.py").write_text(MINE)
    first, second = load_policy("mine.py:Mine"), load_policy("other/mine.py:Mine")
    assert type(first) is not type(second)
    assert type(first).__module__ != type(second).__module__
    (folder / "mine.py").write_text(MINE.replace("2 / pace", "3 / pace"))
    assert load_policy("mine.py:Mine").pace == 3.0


def test_the_shipped_example_is_found_from_anywhere(folder):
    assert load_policy("patrol.py:Patrol", {"step": 2}).step == 2
    assert load_policy("agents/policies/patrol.py:Patrol").relocates


def test_an_installed_package_can_offer_policies(monkeypatch):
    def offered(group):
        entries = {"theirs": "dva_sim.core.dispatch:MinEta", "gone": "no_such_package:X"}
        return EntryPoints(EntryPoint(name, value, group) for name, value in entries.items())

    monkeypatch.setattr(plugins, "entry_points", offered)
    assert isinstance(load_policy("theirs"), MinEta)
    assert {"theirs", "min_eta"} < set(known_policies())
    with pytest.raises(ConfigError, match=r"no_such_package:X .*ModuleNotFound"):
        load_policy("gone")
