"""Identity of a program version: fingerprint, commit and state, in checkouts made here."""

from pathlib import Path

import pytest
from helpers.processes import patience

import dva_sim
from dva_sim.experiments.study.hashing import _CODE, _WORDS, _code, fingerprint, state_of


def test_the_fingerprint_stays_while_nothing_changes():
    assert fingerprint() == fingerprint()


def test_a_profile_in_the_working_folder_changes_it_and_a_page_does_not(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = fingerprint()
    phones = tmp_path / "agents" / "phones"
    phones.mkdir(parents=True)
    (phones / "README.md").write_text("mine")
    assert fingerprint() == before
    (phones / "default.yaml").write_text("filter: none\n")
    assert fingerprint() != before


def test_what_is_left_out_of_it_is_imported_by_nothing_that_counts():
    counted = {name: path.read_text() for name, path in _code(_CODE)}
    assert "simulation/measures/episodes.py" in counted
    for words in _WORDS:
        assert words not in counted
        assert (Path(dva_sim.__file__).parent / words).is_file()
        folder, _, name = words.removesuffix(".py").replace("/", ".").rpartition(".")
        called = (f"dva_sim.{folder}.{name}", f"from dva_sim.{folder} import {name}")
        assert not [n for n, text in counted.items() if any(word in text for word in called)]


WHO = ("-c", "user.name=somebody", "-c", "user.email=somebody@example.org")


def git(folder, *words):
    command = ["git", "-C", str(folder), *WHO, *words]
    return patience.run(command, capture_output=True, text=True, check=True).stdout.strip()


@pytest.fixture
def checkout(tmp_path):
    """A program of one file, and an agent, committed."""
    for name in ("program/__init__.py", "agents/robots/small.yaml"):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text("as it was\n")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "first")
    return tmp_path


def test_a_checkout_as_committed_is_clean(checkout):
    commit = git(checkout, "rev-parse", "HEAD")
    assert len(commit) == 40
    assert state_of(checkout / "program") == {"commit": commit, "dirty": False}


@pytest.mark.parametrize("name", ["program/__init__.py", "program/new.py", "agents/mine.yaml"])
def test_a_file_that_is_changed_or_new_makes_it_dirty(checkout, name):
    (checkout / name).write_text("otherwise\n")
    assert state_of(checkout / "program")["dirty"] is True


@pytest.mark.parametrize("name", ["my-study.yaml", "results/manifest.json"])
def test_results_and_studies_beside_the_program_do_not(checkout, name):
    (checkout / name).parent.mkdir(exist_ok=True)
    (checkout / name).write_text("new\n")
    assert state_of(checkout / "program")["dirty"] is False


def test_a_package_installed_inside_somebodys_checkout_has_no_commit(checkout):
    installed = checkout / "venv" / "program"
    installed.mkdir(parents=True)
    (installed / "__init__.py").write_text("")
    assert state_of(installed) == {"commit": None, "dirty": None}


def test_without_git_nothing_is_known(checkout, monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert state_of(checkout / "program") == {"commit": None, "dirty": None}


def test_the_repository_of_a_hook_that_started_us_is_not_taken_for_our_own(checkout, monkeypatch):
    monkeypatch.setenv("GIT_DIR", str(checkout / "nowhere"))
    assert state_of(checkout / "program")["dirty"] is False
