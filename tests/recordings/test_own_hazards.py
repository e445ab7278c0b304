"""A hazard of the user's own: in a run, in its recording, and in a replay that has only that."""

from pathlib import Path

import numpy as np
import pytest

from dva_sim.kernel import plugins
from dva_sim.kernel.resources import find
from dva_sim.recordings.reading import RecordedHazard, read_recording
from dva_sim.recordings.writing import write_recording
from dva_sim.simulation.full.run import simulate
from dva_sim.simulation.scenario import build

EXAMPLE = "steam_leak.py:SteamLeak"
EVENT = {"kind": EXAMPLE, "room": "Chemistry lab", "at_s": 5.0, "hazard": {"hole_mm": 20}}


def scenario(**event):
    return build({"events": [EVENT | event], "guard": {"count": 1}, "horizon_s": 40.0})


@pytest.fixture(scope="module")
def run():
    return simulate(scenario(), 1, keep_traffic=True)


@pytest.fixture(scope="module")
def file(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    write_recording(run, path)
    return path


def test_it_breaks_out_is_noticed_and_is_told_of_as_what_messages_know(run):
    (incident,) = run.incidents
    assert (incident.kind, incident.hazard.title) == ("gas_leak", "steam leak")
    assert incident.detector.name == "Chemistry lab smoke"
    story = [moment.what for moment in run.recorder.timeline]
    assert {"steam leak breaks out", "reports gas leak"} <= set(story)
    assert [event.kind for event in run.events] == ["gas_leak"]


def test_its_air_hides_things_from_cameras(run):
    x, y = run.incidents[0].hazard.position
    assert run.surroundings.at(x + 0.5, y, 20.0).temperature > 30.0
    assert run.surroundings.optical_depth((x, y), (x + 1.0, y), 20.0) > 3.0
    assert run.surroundings.optical_depth((x, y), (x + 1.0, y), 4.0) == 0.0


def test_a_replay_shows_it_without_its_class(file, run, monkeypatch):
    monkeypatch.setattr(plugins, "_run", None)  # nothing can be loaded
    playback = read_recording(file).playback
    (incident,), hazard = playback.incidents, run.incidents[0].hazard
    assert isinstance(incident.hazard, RecordedHazard)
    assert (incident.hazard.title, incident.hazard.mark) == ("steam leak", "P")
    assert incident.hazard.position == pytest.approx(hazard.position)
    for time in (3.0, 6.5, 30.0):
        assert incident.hazard.radius(time) == pytest.approx(hazard.radius(time), abs=0.01)
        assert incident.hazard.danger_radius(time) == pytest.approx(
            hazard.danger_radius(time), abs=0.01
        )


def test_what_lies_over_the_floor_comes_back_as_it_was_recorded(file, run):
    playback = read_recording(file).playback
    for time in (4.0, 20.0):
        there = run.surroundings.raster("smoke", time, 0.5)
        again = playback.surroundings.raster("smoke", time)
        assert np.allclose(again.extent, there.extent) or time == 4.0
        assert again.values.max() == pytest.approx(there.values.max(), rel=1e-3)
    assert np.allclose(again.values, there.values, rtol=1e-3)
    assert playback.surroundings.raster("water", 20.0).values.max() == 0.0


def test_a_class_beside_the_scenario_is_found_from_anywhere(tmp_path, monkeypatch):
    from dva_sim.simulation.scenario import load

    (tmp_path / "mine.py").write_bytes(find("steam_leak", "worlds/hazards", ".py").read_bytes())
    (tmp_path / "own.yaml").write_text("events: [{kind: 'mine.py:SteamLeak', reported: true}]")
    monkeypatch.chdir(Path("/"))
    (event,) = build(load(str(tmp_path / "own.yaml"))).events
    assert event.kind == f"{tmp_path / 'mine.py'}:SteamLeak"
