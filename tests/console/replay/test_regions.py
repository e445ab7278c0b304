"""A recording of several DVAs in the console: borders, and the DVA of each device."""

import pytest
from helpers.console.declared_lines import checked

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
    assert dva_of("dva-east", 15.0) is None


def test_the_map_has_the_borders_and_claims_nothing_of_who_serves_what(recorded):
    lines = {}
    player = Player(recorded)
    player.tell = lambda line, key="": lines.update({line["k"]: checked(line)})
    player.begin()
    assert [one["name"] for one in lines["scene"]["site"]["regions"]] == ["west", "east"]
    assert "regions" not in lines["rows"]
    player.close()
