"""Reading a recording returns what was written, as far as the file goes."""

import dataclasses
import random
import resource

import numpy as np
import pytest
from mcap.reader import make_reader
from PIL import Image
from recordings.runs import drill, drive, evacuation, run_of

from dva_sim import __version__
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.recordings import writing
from dva_sim.recordings.pictures.stills import still
from dva_sim.recordings.reading import read_recording
from dva_sim.recordings.writing import write_recording
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import simulate
from dva_sim.simulation.measures.episodes import tables_of

RUNS = {"drive": drive, "drill": drill, "evacuation": evacuation}


# --- the file ------------------------------------------------------------------------------


def test_the_same_seed_makes_the_same_bytes(folder, tmp_path):
    again = run_of.__wrapped__("drive-to-event", 30)
    write_recording(again, tmp_path / "again.mcap", tables=tables_of(again))
    assert (tmp_path / "again.mcap").read_bytes() == (folder / "drive.mcap").read_bytes()


@pytest.mark.parametrize("row", [{"number": 1}, {"more": 1}, [], {"time_s": "soon"}])
def test_rows_of_an_audit_log_that_no_log_writes_are_refused(folder, tmp_path, row):
    run = run_of("drive-to-event", 30)
    path = tmp_path / "run.mcap"
    write_recording(run, path, audit=[(1.0, row)])
    with pytest.raises(ConfigError, match="cannot be read"):
        read_recording(path)


def test_another_reader_finds_everything_in_virtual_time(folder):
    with (folder / "drill.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        times = [message.log_time for _, _, message in reader.iter_messages()]
        attached = [attachment.name for attachment in reader.iter_attachments()]
        about = next(reader.iter_metadata()).metadata
    assert times == sorted(times)
    assert (times[0], times[-1]) == (0, 90_000_000_000)
    assert summary.statistics.message_count == len(times) > 1500
    assert attached == [
        *("scenario.json", "run.json", "tables.json"),
        *("site/caparica.geojson", "site/caparica.yaml"),
    ]
    assert (about["version"], about["seed"], about["site"]) == (__version__, "3", "caparica")


def test_messages_are_the_bytes_that_went_over_the_network(folder):
    with (folder / "drive.mcap").open("rb") as file:
        raw = [
            (channel.metadata["source"], channel.metadata["destination"], message.data)
            for _, channel, message in make_reader(file).iter_messages()
            if channel.message_encoding == "xml"
        ]
    sent = [
        (s.source, s.destination, s.payload)
        for s in drive().recorder.traffic
        if isinstance(s.payload, bytes)
    ]
    assert sorted(raw) == sorted(sent)
    assert len(raw) > 300


SCHEMAS = 20_000  # once in each file [B]


def test_a_minute_takes_less_than_half_a_megabyte(folder):
    for name, run in RUNS.items():
        size = (folder / f"{name}.mcap").stat().st_size - SCHEMAS
        assert size / (run().duration / 60) < 500e3, name


def test_a_run_without_its_messages_cannot_be_recorded(tmp_path):
    scenario = scenarios.build(scenarios.load("drive-to-event"), {"horizon_s": 1})
    with pytest.raises(ValueError, match="keep_traffic"):
        write_recording(simulate(scenario, 1), tmp_path / "run.mcap")
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_leaves_the_old_file_and_no_part_of_a_new_one(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(b"old")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, before[1]))
    try:
        with pytest.raises(DvaSimError, match=r"run\.mcap .*File too large"):
            write_recording(drive(), path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert [p.name for p in tmp_path.iterdir()] == ["run.mcap"]
    assert path.read_bytes() == b"old"


# --- what is read back -----------------------------------------------------------------------


@pytest.mark.parametrize("name", RUNS)
def test_the_story_comes_back_word_for_word(opened, name):
    read = opened[name].playback
    now, then = read.recorder.timeline, RUNS[name]().recorder.timeline
    assert [m[1:] for m in now] == [m[1:] for m in then]
    assert [m.time for m in now] == pytest.approx([m.time for m in then], abs=1e-6)
    assert read.duration == RUNS[name]().duration


@pytest.mark.parametrize("name", RUNS)
def test_everybody_is_where_they_were_at_every_tenth_of_a_second(opened, name):
    then = RUNS[name]().recorder.tracks
    now = opened[name].playback.recorder.tracks
    assert sorted(now) == sorted(then)
    for who, track in then.items():
        assert [p.mode for p in now[who]] == [p.mode for p in track], who
        a, b = (np.array([p[:4] for p in each]) for each in (now[who], track))
        assert np.abs(a[:, :3] - b[:, :3]).max() < 1e-4, who
        turned = (a[:, 3] - b[:, 3] + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(turned).max() < 1e-4, who


def test_who_left_is_not_there_at_the_end(opened):
    tracks = opened["evacuation"].playback.recorder.tracks
    ends = {who: track[-1].time for who, track in tracks.items()}
    assert {who: t[-1].time for who, t in evacuation().recorder.tracks.items()} == ends
    assert min(ends.values()) < 55 < max(ends.values())


def test_messages_screens_and_commands_come_back(opened):
    then, now = drive().recorder, opened["drive"].playback.recorder
    assert [s[:3] for s in now.traffic] == [s[:3] for s in then.traffic]
    (drove,), (driven,) = then.drives, now.drives
    assert [f[:2] for f in driven.frames] == [f[:2] for f in drove.frames]
    assert len(driven.commands) == len(drove.commands) > 100
    robot = drove.robot
    assert len(now.views[robot]) == len(then.views[robot]) > 100


def test_what_a_person_calls_a_phone_breaks_no_recording(tmp_path):
    run = drive()
    (drove,) = run.recorder.drives
    labels = run.labels | {drove.operator: "A/B <b>?\u00e9</b> /pose"}
    path = tmp_path / "named.mcap"
    write_recording(dataclasses.replace(run, labels=labels), path, tables=tables_of(run))
    now = read_recording(path).playback
    assert now.labels[drove.operator] == labels[drove.operator]
    assert [s[:3] for s in now.recorder.traffic] == [s[:3] for s in run.recorder.traffic]
    assert len(now.recorder.drives[0].commands) == len(drove.commands)
    assert set(now.recorder.tracks) == set(run.recorder.tracks)


def test_the_tables_come_with_it(opened):
    tables = opened["drill"].tables
    assert str(tables["runs"]) == str(tables_of(drill())["runs"])
    assert [row["kind"] for row in tables["events"]] == ["fire", "gas_leak"]


@pytest.mark.parametrize("name", RUNS)
def test_how_everything_ended_comes_back(opened, name):
    endings = opened[name].playback.endings
    assert endings == RUNS[name]().endings
    assert len(endings) == len(RUNS[name]().incidents) > 0


def test_the_site_and_its_hazards_are_the_same(opened):
    now, then = opened["drill"].playback, drill()
    assert np.array_equal(now.site.grid.cells, then.site.grid.cells)
    assert now.site.room("Kitchen").polygon.tolist() == then.site.room("Kitchen").polygon.tolist()
    assert now.incidents[0].hazard == then.incidents[0].hazard
    for what in ("smoke", "gas", "heat"):
        a, b = (each.surroundings.raster(what, 80.0).values for each in (now, then))
        assert np.array_equal(a, b)
        assert a.max() > 0


def test_a_bare_map_comes_back_cell_by_cell(tmp_path):
    shades = np.full((200, 300), 254, np.uint8)
    shades[:, [0, -1]] = shades[[0, -1]] = shades[90:110, 100:140] = 0
    shades[20:40, 200:260] = 205
    Image.fromarray(shades).save(tmp_path / "depot.png")
    (tmp_path / "depot.yaml").write_text(
        "image: depot.png\nresolution: 0.05\norigin: [-2.5, 1.0, 0.3]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    changes = {"site.map": str(tmp_path / "depot.yaml"), "horizon_s": 2}
    scenario = scenarios.build(scenarios.load("drive-to-event"), changes)
    run = simulate(scenario, 5, keep_traffic=True)
    write_recording(run, tmp_path / "map.mcap")
    site = read_recording(tmp_path / "map.mcap").playback.site
    assert np.array_equal(site.grid.cells, run.site.grid.cells)
    assert [int((site.grid.cells == state).sum()) for state in (100, 255)] == [1796, 1200]
    assert site.grid.origin == run.site.grid.origin
    assert site.robot_bases == run.site.robot_bases


@pytest.mark.system
def test_a_picture_from_the_file_is_the_picture_from_the_run(opened, tmp_path):
    """Places are kept to a tenth of a millimetre: shades may differ, by a hair."""
    for name, run in (("file", opened["drill"].playback), ("run", drill())):
        still([run], 80.0).savefig(tmp_path / f"{name}.png", dpi=40)
    a, b = (pixels(tmp_path / f"{name}.png") for name in ("file", "run"))
    assert np.abs(a - b).max() <= 8
    assert b.std() > 10


def pixels(path):
    with Image.open(path) as picture:
        return np.asarray(picture, float)


# --- damage ----------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.5, 0.6, 0.7])
def test_of_a_file_cut_short_all_that_is_there_is_read(folder, tmp_path, share):
    whole = (folder / "evacuation.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: int(share * len(whole))])
    opened = read_recording(tmp_path / "cut.mcap")
    until = opened.playback.duration
    assert not opened.is_whole
    assert opened.playback.endings == []  # nobody knows
    assert 0 < until < opened.lasted == 60.0
    story = [m[1:] for m in evacuation().recorder.timeline if m.time < until]
    assert [m[1:] for m in opened.playback.recorder.timeline][: len(story)] == story
    there = {n for n, t in evacuation().recorder.tracks.items() if t[-1].time >= until}
    ends = {n: t[-1].time for n, t in opened.playback.recorder.tracks.items()}
    assert there
    assert all(ends[name] == until for name in there)


@pytest.mark.system
def test_a_damaged_file_ends_in_one_line(folder, opened, tmp_path):
    """Whatever byte is wrong, nothing is read that was not written."""
    whole, rng = (folder / "drive.mcap").read_bytes(), random.Random(1)
    right = opened["drive"].playback.recorder.timeline
    reports = []
    for _ in range(12):
        damaged = bytearray(whole)
        damaged[rng.randrange(len(whole))] ^= 1 << rng.randrange(8)
        (tmp_path / "bad.mcap").write_bytes(damaged)
        try:
            read = read_recording(tmp_path / "bad.mcap").playback.recorder.timeline
        except ConfigError as error:
            reports.append(str(error))
        else:
            assert read == right[: len(read)]
    assert len(reports) > 6
    assert all("\n" not in line and "bad.mcap: " in line for line in reports)


def test_a_file_that_is_cut_before_the_run_begins_is_told(folder, tmp_path):
    (tmp_path / "cut.mcap").write_bytes((folder / "drive.mcap").read_bytes()[:200])
    with pytest.raises(ConfigError, match="cut short before"):
        read_recording(tmp_path / "cut.mcap")


def test_a_recording_of_a_later_form_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(writing, "FORMAT", 2)
    write_recording(drive(), tmp_path / "later.mcap")
    with pytest.raises(ConfigError, match=f"dva-sim {__version__} .*form 2 "):
        read_recording(tmp_path / "later.mcap")


# --- what people decide --------------------------------------------------------------------


def test_what_was_decided_by_whom_and_why_is_part_of_a_recording(tmp_path):
    recording = run_of("asked-first", 60)
    write_recording(recording, tmp_path / "asked.mcap")
    back = read_recording(tmp_path / "asked.mcap").playback
    people = [fact for fact in recording.facts if fact.role is not None]
    assert people
    assert [f.action for f in back.facts] == [f.action for f in recording.facts]
    for read, kept in zip(back.facts, recording.facts, strict=True):
        assert read.time == pytest.approx(kept.time, abs=1e-6)
        assert read.row() | {"time": 0} == kept.row() | {"time": 0}


def test_a_recording_without_people_who_decide_holds_no_facts(folder):
    with (folder / "drill.mcap").open("rb") as file:
        topics = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert "/facts" not in topics
