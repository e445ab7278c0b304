"""A recording of several DVAs in the console: borders, and the DVA of each device."""

import pytest
from helpers.console.declared_lines import checked
from helpers.console.recorded_console import RecordedPage
from helpers.console.simulated_phone import PhonePage

from dva_sim.console.replay.player import Player
from dva_sim.console.replay.recorded_run import RecordedRun
from dva_sim.recordings.reading import read_recording
from dva_sim.recordings.writing import write_recording
from dva_sim.simulation.full.run import simulate
from dva_sim.simulation.measures.episodes import tables_of
from dva_sim.simulation.scenario import build

HALL = {
    "site": {"name": "hall"},
    "robot": {"count": 1},
    "operator": {"count": 1},
    "guard": {"count": 2},
    "dva": {
        "regions": {
            "west": {"polygon": [[0, 0], [30, 0], [30, 40], [0, 40]]},
            "east": {"rest": True},
        },
        "deaths": [{"region": "east", "at_s": 20.0}],
    },
    "events": [{"kind": "fire", "position": [50, 20], "at_s": 5, "reported": True}],
    "horizon_s": 60,
}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> RecordedRun:
    path = tmp_path_factory.mktemp("regions") / "run.mcap"
    recording = simulate(build(HALL, {}), 1, keep_traffic=True)
    write_recording(recording, path, tables=tables_of(recording))
    return RecordedRun(read_recording(path), path.name)


def test_each_moment_shows_with_whom_a_device_was_registered(recorded):
    def dva_of(label, now):
        rows = recorded.devices(now)["devices"]
        return next(row["dva"] for row in rows if row["label"] == label)

    assert dva_of("guard-1", 15.0) == "dva-east"
    assert dva_of("guard-1", 45.0) == "dva-west"
    assert dva_of("robot-1", 45.0) == "dva-west"


def states(run: RecordedRun, now: float) -> dict[str, str]:
    return {row["name"]: row["state"] for row in run.system.regions(now)}


def test_each_moment_shows_who_serves_the_regions(monkeypatch, tmp_path):
    page = PhonePage(monkeypatch, scenario=HALL)
    kept = RecordedPage(page, tmp_path / "own.mcap")
    page.let(45.0)
    kept.finish()
    run = RecordedRun(read_recording(tmp_path / "own.mcap"), "own.mcap")
    assert states(run, 1.0) == states(run, 15.0) == {"west": "served", "east": "served"}
    assert states(run, 27.0) == {"west": "served", "east": "dead"}
    assert states(run, 44.0) == {"west": "served", "east": "deputy"}


def test_the_last_dva_whom_nobody_hears_is_not_called_dead(recorded):
    assert states(recorded, 15.0) == {"west": "served", "east": "served"}
    assert states(recorded, 27.0) == {}


def test_the_map_has_the_borders(recorded):
    lines = {}
    player = Player(recorded)
    player.tell = lambda line, key="": lines.update({line["k"]: checked(line)})
    player.begin()
    assert [one["name"] for one in lines["scene"]["site"]["regions"]] == ["west", "east"]
    assert [one["name"] for one in lines["rows"]["regions"]] == ["west", "east"]
    player.close()
