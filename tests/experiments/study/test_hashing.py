"""The fingerprint of the program: what makes old runs stale, and what does not."""

from __future__ import annotations

from pathlib import Path

import pytest

from dva_sim.experiments.study.hashing import fingerprint


def test_the_fingerprint_stays_while_nothing_changes() -> None:
    assert fingerprint() == fingerprint()


def test_a_profile_in_the_working_folder_changes_it_and_a_page_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = fingerprint()
    phones = tmp_path / "agents" / "phones"
    phones.mkdir(parents=True)
    (phones / "README.md").write_text("mine")
    assert fingerprint() == before
    (phones / "default.yaml").write_text("filter: none\n")
    assert fingerprint() != before
