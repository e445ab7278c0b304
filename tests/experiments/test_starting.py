"""The study to begin with is one that works."""

import pytest

from dva_sim.checking.files import check_file
from dva_sim.errors import ConfigError, DvaSimError
from dva_sim.experiments import design
from dva_sim.experiments.registration import register
from dva_sim.experiments.starting import write_study
from dva_sim.experiments.study import load_study


@pytest.fixture
def fresh(tmp_path, monkeypatch):
    """The file of a new study."""
    monkeypatch.chdir(tmp_path)
    write_study("mine")
    return tmp_path / "mine.yaml"


def test_a_new_study_is_valid_as_it_stands_in_both_versions(fresh):
    assert check_file(fresh).problems == []
    assert load_study(fresh, version="full").persons == 24


def test_it_is_small_enough_to_try_at_once(fresh):
    assert len(design.jobs(load_study(fresh))) == 8 * 2 * 6


def test_it_can_be_registered_as_it_stands(fresh):
    register(load_study(fresh))
    assert load_study(fresh).status.kind == "confirmatory"


def test_every_key_it_shows_in_a_comment_is_valid_too(fresh):
    text = fresh.read_text()
    shown = [line.removeprefix("# ") for line in text.splitlines() if line.startswith("# design:")]
    shown += [line.removeprefix("# ") for line in text.splitlines() if line.startswith("# stop:")]
    assert len(shown) == 4
    (fresh.parent / "rows.csv").write_text("link.loss\n0\n0.01\n")
    for line in shown:
        plain = text.replace("[0, 0.1, 0.25]", "[0, 0.25]") if "zip" in line else text
        fresh.write_text(f"{plain.partition('full:')[0]}\n{line}\n")
        assert design.cells(load_study(fresh))


def test_nothing_is_overwritten(fresh):
    with pytest.raises(ConfigError, match=r"mine\.yaml is there already; give another name"):
        write_study("mine.yaml")
    with pytest.raises(DvaSimError, match="cannot be written: No such file or directory"):
        write_study("nowhere/mine")
