"""`dva-sim check` of files as other programs write them: maps, recorded links, recordings."""

import gzip
import json

import numpy as np
import pytest
import zstandard
from helpers.wording import unnamed
from mcap.reader import make_reader
from mcap.writer import Writer
from PIL import Image

from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.reading import read_recording
from dva_sim.recordings.writing import write_recording
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import simulate
from dva_sim.simulation.scenario import contradictions
from dva_sim.testing.files import check_file
from dva_sim.worlds.maps import FREE, OCCUPIED, UNKNOWN, load_ros_map

# --- ROS maps --------------------------------------------------------------------------

SEEN, WALL, NEVER = 254, 0, 205


def floor(size=160):
    """A walled square of 14 m x 14 m at 0.1 m, never seen around it."""
    shades = np.full((size, size), NEVER, np.uint8)
    shades[10:-10, 10:-10] = WALL
    shades[11:-11, 11:-11] = SEEN
    return shades


def ros_map(folder, image="map.pgm", maxval=255, shades=None, **keys):
    shades = floor() if shades is None else shades
    if maxval == 255:
        Image.fromarray(shades).save(folder / image)
    else:
        head = f"P5\n# as some editors write it\n{shades.shape[1]} {shades.shape[0]}\n{maxval}\n"
        (folder / image).write_bytes(head.encode() + shades.tobytes())
    values = {"image": image, "resolution": 0.1, "origin": "[0, 0, 0]", "negate": 0}
    values |= {"occupied_thresh": 0.65, "free_thresh": 0.25, **keys}
    file = folder / "map.yaml"
    file.write_text("".join(f"{key}: {value}\n" for key, value in values.items()))
    return file


@pytest.mark.parametrize(
    ("image", "maxval"), [("map.pgm", 255), ("map.pgm", 254), ("map.jpg", 255)]
)
def test_what_was_never_seen_stays_unknown(tmp_path, image, maxval):
    file = ros_map(tmp_path, image, maxval)
    cells = load_ros_map(file).cells
    assert (cells[:8] == UNKNOWN).all()
    assert (cells[20:-20, 20:-20] == FREE).all()
    assert (cells[10, 20:-20] == OCCUPIED).all()
    lossy = [doubt for doubt in check_file(file).doubts if "JPEG" in doubt]
    assert len(lossy) == (image == "map.jpg")


def test_shades_near_that_of_the_unknown_that_count_as_free_are_doubted(tmp_path):
    shades = floor()
    shades[shades == NEVER] = 209
    (doubt,) = check_file(ros_map(tmp_path, shades=shades)).doubts
    share = np.mean(shades == 209)
    assert unnamed(doubt, f"{share:.1%}", "205", "free_thresh 0.25") == []


@pytest.mark.parametrize(
    ("keys", "shade", "names"),
    [
        ({"mode": "scale"}, NEVER, ["the shade 205", "free_thresh 0.25"]),
        ({"mode": "scale", "negate": 1}, 255 - NEVER, ["the shade 50"]),
        ({"mode": "scale"}, NEVER + 4, []),  # measured there
        ({"negate": "true"}, 255 - NEVER, []),
        ({"negate": "true"}, 255 - NEVER - 4, ["a shade near 50"]),
    ],
)
def test_unknown_cells_of_scale_and_negated_maps_that_count_as_free_are_doubted(
    tmp_path, keys, shade, names
):
    shades = floor()
    never = shades == NEVER
    shades = 255 - shades if "negate" in keys else shades
    shades[never] = shade
    doubts = check_file(ros_map(tmp_path, shades=shades, **keys)).doubts
    assert len(doubts) == bool(names)
    assert unnamed(" ".join(doubts), *names) == []


@pytest.mark.parametrize(
    ("keys", "names"),
    [
        ({"frame_id": "map"}, ["'frame_id'"]),
        ({"negat": 1}, ["'negat'", "'negate'"]),
        ({"origin": "[0, 0, 90]"}, ["90 rad", "14.3 turns", "1.5708"]),
        ({"origin": "[0, 0, -7]"}, ["-7 rad", "1.1 turns"]),
    ],
)
def test_keys_of_other_tools_and_odd_numbers_are_doubted_and_read(tmp_path, keys, names):
    verdict = check_file(ros_map(tmp_path, **keys))
    assert verdict.problems == []
    (doubt,) = verdict.doubts
    assert unnamed(doubt, *names) == []


def test_a_map_without_a_doubt_has_none(tmp_path):
    assert check_file(ros_map(tmp_path, origin="[-8, -6, 6.28]")).doubts == []


def test_a_map_on_which_nothing_finds_a_place_to_burn_says_in_how_many_runs(tmp_path):
    shades = floor()
    shades[::9, ::9] = WALL  # a forest of posts, 0.9 m apart
    (doubt,) = check_file(ros_map(tmp_path, shades=shades)).doubts
    assert unnamed(doubt, "6 of 6", "fire") == []


def test_doubts_of_its_map_are_a_scenarios_too(tmp_path):
    file = ros_map(tmp_path, frame_id="map")
    scenario = scenarios.build(scenarios.load("drive-to-event"), {"site.map": str(file)})
    assert [doubt for doubt in contradictions(scenario) if "'frame_id'" in doubt]


# --- recorded links --------------------------------------------------------------------


def link_file(folder, text, name="link.up", encoding="utf-8"):
    (folder / name).write_text(text, encoding=encoding)
    return folder / name


PING = """\
[1700000000.1] 64 bytes from 10.0.0.1: icmp_seq=1 ttl=64 time=80.0 ms
[1700000001.06] 64 bytes from 10.0.0.1: icmp_seq=2 ttl=64 time=40.0 ms
"""


@pytest.mark.parametrize(
    ("name", "text", "names"),
    [
        ("a.up", "10\n20\n30\n", ["3 packet", "0.03 s", "1,200 kbit/s"]),
        ("a.down", "10\r\n20\r\n30", ["3 packet"]),
        ("trace.txt", "10\n20\n30\n", ["3 packet"]),
        ("delays.txt", "20.5\n30\n10\n", ["3 delays", "20.5 ms in the median", "29.1 ms"]),
        ("log.csv", "# s, ms\n0,20\n1,lost\n2,30.5\n", ["3 probes", "33.3%", "25.2 ms"]),
        ("log.csv", "rtt_us,time_s\n20000,1\n40000,2\n", ["30 ms in the median", "in us"]),
        ("lab.log", PING, ["2 probes in 1 s", "60 ms in the median", "times in s"]),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_a_recorded_link_is_known_when_it_is_named(tmp_path, name, text, names, encoding):
    verdict = check_file(link_file(tmp_path, text, name, encoding))
    assert (verdict.kind, verdict.problems, list(verdict.doubts)) == ("recorded link", [], [])
    assert unnamed(verdict.note, *names) == []


def test_a_line_of_a_trace_that_is_no_millisecond_is_told_with_its_number(tmp_path):
    (problem,) = check_file(link_file(tmp_path, "10\n2o\n30\n")).problems
    assert problem.line == 2
    assert "'2o'" in problem.text


@pytest.mark.parametrize("name", ["iperf.json", "iperf.txt", "iperf.up"])
def test_a_report_of_iperf3_is_named_for_what_it_is(tmp_path, name):
    text = '{"intervals": [{"sum": {"bits_per_second": 5e6}}]}'
    verdict = check_file(link_file(tmp_path, text, name))
    assert verdict.kind == "recorded link"
    assert unnamed(verdict.problems[0].text, "iperf3", "5,000,000 bit/s", "link.rate_bps") == []
    assert "round trips" not in verdict.problems[0].text


def test_round_trips_in_a_report_of_iperf3_are_turned_into_the_key_that_they_can_give(tmp_path):
    streams = [{"bits_per_second": 5e6, "rtt": trip} for trip in (40_000, 0, 46_000, 60_000)]
    text = json.dumps({"intervals": [{"streams": [stream]} for stream in streams]})
    verdict = check_file(link_file(tmp_path, text, "iperf.json"))
    named = "46 ms in the median", "link.delay_s=0.023"
    assert unnamed(verdict.problems[0].text, "iperf3", "link.rate_bps", *named) == []


def test_a_doubtful_unit_of_a_delay_log_is_a_warning_of_the_file_and_the_scenario(tmp_path):
    file = link_file(tmp_path, "0 0.04\n1 0.05\n", "log.txt")
    (doubt,) = check_file(file).doubts
    assert "0.045 ms" in doubt
    scenario = scenarios.build(scenarios.load("drive-to-event"), {"link.delay_log": str(file)})
    assert [report for report in contradictions(scenario) if doubt in report]


EPOCH = "1596042000000\n1596042000010\n1596042000030\n"


def test_a_trace_that_carries_nothing_for_longer_than_a_run_is_told_with_the_time(tmp_path):
    file = link_file(tmp_path, EPOCH)
    (doubt,) = check_file(file).doubts
    assert "1,596,042,000 s" in doubt
    scenario = scenarios.build(scenarios.load("drive-to-event"), {"link.trace_up": str(file)})
    reports = [doubt for doubt in contradictions(scenario) if "trace_up" in doubt]
    assert unnamed(*reports, "1,596,042,000 s", "horizon_s 600") == []


def test_a_gap_that_is_shorter_than_a_run_is_not_told(tmp_path):
    file = link_file(tmp_path, "10\n59000\n60000\n")
    scenario = scenarios.build(scenarios.load("drive-to-event"), {"link.trace_up": str(file)})
    assert not [doubt for doubt in contradictions(scenario) if "trace_up" in doubt]


# --- recordings ------------------------------------------------------------------------


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    file = tmp_path_factory.mktemp("recorded") / "run.mcap"
    scenario = scenarios.build(scenarios.load("drive-to-event"), {"horizon_s": 4.0})
    write_recording(simulate(scenario, seed=1, keep_traffic=True), file)
    return file


def filtered(recorded, out, *, metadata=True, attachments=True, without=()):
    """Copy of a recording by another program, which leaves some of it out."""
    with recorded.open("rb") as file, out.open("wb") as target:
        reader, writer = make_reader(file), Writer(target)
        writer.start(profile="", library="filter 1.0")
        schemas, channels = {}, {}
        for schema, channel, message in reader.iter_messages():
            if channel.topic in without:
                continue
            if schema.id not in schemas:
                reported = schema.name, schema.encoding, schema.data
                schemas[schema.id] = writer.register_schema(*reported)
            if channel.id not in channels:
                reported = channel.topic, channel.message_encoding, schemas[schema.id]
                channels[channel.id] = writer.register_channel(*reported, channel.metadata)
            when = message.log_time, message.data, message.publish_time, message.sequence
            writer.add_message(channels[channel.id], *when)
        for each in reader.iter_metadata() if metadata else ():
            writer.add_metadata(each.name, each.metadata)
        for each in reader.iter_attachments() if attachments else ():
            about = each.create_time, each.log_time, each.name, each.media_type
            writer.add_attachment(*about, each.data)
        writer.finish()
    return out


def test_a_recording_that_another_program_copied_whole_is_valid(recorded, tmp_path):
    assert check_file(filtered(recorded, tmp_path / "copy.mcap")).problems == []


@pytest.mark.parametrize("kept", ["metadata", "attachments"])
def test_a_recording_without_metadata_or_attachments_was_filtered(recorded, tmp_path, kept):
    parts = {"metadata": False, "attachments": False} | {kept: True}
    (problem,) = check_file(filtered(recorded, tmp_path / "part.mcap", **parts)).problems
    lost = "attachments" if kept == "metadata" else "metadata"
    assert unnamed(problem.text, "filtered", "filter 1.0", f"without its {lost}") == []


def test_a_recording_without_some_messages_was_filtered_and_says_of_which_topic(recorded, tmp_path):
    file = filtered(recorded, tmp_path / "part.mcap", without=["/observed/moves"])
    (problem,) = check_file(file).problems
    assert unnamed(problem.text, "filtered", "/observed/moves") == []
    assert read_recording(file).left_out.keys() == {"/observed/moves"}
    assert read_recording(recorded).left_out == {}


@pytest.mark.parametrize("encoding", ["cdr", "json"])
def test_a_recording_of_another_program_is_not_damaged(tmp_path, encoding):
    file = tmp_path / "bag.mcap"
    with file.open("wb") as target:
        writer = Writer(target)
        writer.start(profile="ros2", library="recorder 1.4")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/chatter", encoding, schema)
        writer.add_message(channel, 0, b'{"data": 1}' if encoding == "json" else b"\0\1\0\0", 0)
        writer.finish()
    (problem,) = check_file(file).problems
    assert unnamed(problem.text, "'ros2'", "'recorder 1.4'", "dva-sim") == []
    assert "damaged" not in problem.text
    with pytest.raises(ConfigError, match="ros2"):
        read_recording(file)


@pytest.mark.parametrize(
    ("name", "pack", "how"),
    [
        ("run.mcap.zstd", zstandard.compress, "zstd"),
        ("run.mcap.gz", gzip.compress, "gzip"),
        ("run.mcap", gzip.compress, "gzip"),
    ],
)
def test_a_recording_that_was_compressed_as_a_file_says_so(recorded, tmp_path, name, pack, how):
    (tmp_path / name).write_bytes(pack(recorded.read_bytes()))
    (problem,) = check_file(tmp_path / name).problems
    assert unnamed(problem.text, "compressed", how, "unpack") == []
