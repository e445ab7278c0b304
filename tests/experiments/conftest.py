"""Results of the small study, made once."""

import shutil
from pathlib import Path

import pytest
from helpers.studies import small_study as kit
from helpers.studies.small_study import run_study

from dva_sim.experiments.results.results import Results


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A results folder to read, made in one process without interruption."""
    folder = tmp_path_factory.mktemp("small")
    return run_study(kit.study_in(folder), folder / "out", jobs=1, episode=kit.cheap)


@pytest.fixture(scope="session")
def results(finished: Path) -> Results:
    """Results as loaded in Python."""
    return Results.load(finished)


@pytest.fixture(scope="session")
def plain(finished: Path) -> dict[str, bytes]:
    """Its files."""
    return kit.files(finished)


@pytest.fixture
def out(finished: Path, tmp_path: Path) -> Path:
    """A copy of it, to change."""
    return Path(shutil.copytree(finished, tmp_path / "out"))
