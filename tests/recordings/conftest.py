"""Recordings of the short runs, written and read once."""

from pathlib import Path

import pytest
from recordings.runs import drill, drive, evacuation

from dva_sim.recordings.reading import Opened, read_recording
from dva_sim.recordings.writing import write_recording
from dva_sim.simulation.measures.episodes import tables_of


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("recordings")
    for run in (drive, drill, evacuation):
        write_recording(run(), folder / f"{run.__name__}.mcap", tables=tables_of(run()))
    return folder


@pytest.fixture(scope="session")
def opened(folder: Path) -> dict[str, Opened]:
    """Content of each recording, by its name."""
    return {path.stem: read_recording(path) for path in folder.glob("*.mcap")}
