"""The fingerprint of the program: what makes old runs stale, and what does not."""

from pathlib import Path

import dva_sim
from dva_sim.experiments.study.hashing import _CODE, _WORDS, _code, fingerprint


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
    assert "simulation/full/measures.py" in counted
    for words in _WORDS:
        assert words not in counted
        assert (Path(dva_sim.__file__).parent / words).is_file()
        folder, _, name = words.removesuffix(".py").replace("/", ".").rpartition(".")
        called = (f"dva_sim.{folder}.{name}", f"from dva_sim.{folder} import {name}")
        assert not [n for n, text in counted.items() if any(word in text for word in called)]
