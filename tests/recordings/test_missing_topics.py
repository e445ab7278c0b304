"""A recording that lacks topics: `check` and `replay` say which rules they could not judge."""

import re
from collections.abc import Collection
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from recordings.runs import run_of
from rich.console import Console

from dva_sim.cli import checks, stories
from dva_sim.kernel.errors import ExitCode
from dva_sim.recordings.pictures import Wanted
from dva_sim.recordings.reading import read_recording
from dva_sim.recordings.writing import COUNTS, write_recording
from dva_sim.simulation.full.verdicts import HELD, RulesNotJudged
from dva_sim.simulation.measures.episodes import tables_of
from dva_sim.testing.evidence import judged_recording

OF_ROBOTS, OF_THE_DVA = ["S1", "S2", "S3", "S4", "S5"], ["S6", "S7"]
ALL = [*OF_ROBOTS, *OF_THE_DVA]
FACTS = ("accepted", "arrived", "heard", "places", "moves", "book")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file, run = tmp_path_factory.mktemp("whole") / "drive.mcap", run_of("drive-to-event", 12)
    write_recording(run, file, tables=tables_of(run))
    return file


def filtered(source: Path, made: Path, topics: Collection[str], counts: bool) -> Path:
    """Write a recording again without some topics, and perhaps without its counts."""
    with source.open("rb") as file, made.open("wb") as out:
        reader, writer = make_reader(file), Writer(out)
        writer.start(reader.get_header().profile)
        channels: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages():
            if channel.topic in topics:
                continue
            if channel.id not in channels:
                of = schema and writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, of or 0, channel.metadata
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time
            )
        for each in reader.iter_attachments():
            writer.add_attachment(
                each.create_time, each.log_time, each.name, each.media_type, each.data
            )
        for entry in reader.iter_metadata():
            if counts or entry.name != COUNTS:
                writer.add_metadata(entry.name, entry.metadata)
        writer.finish()
    return made


NEEDED_BY = {
    "/observed/accepted": OF_ROBOTS,
    "/observed/arrived": ["S1", "S2", "S3", "S5", "S6"],
    "/observed/book": OF_THE_DVA,
    "/observed/heard": ["S2"],
    "/observed/moves": OF_ROBOTS,
    "/observed/places": ["S6"],
    "/messages/robot-1/operator-1": ALL,
    "/messages/operator-1/dva": ALL,
    "/robot-1/camera": OF_ROBOTS,
    "/robot-1/pose": [],
    "/story": [],
    "/tf": [],
}
"""Rules that need a topic."""
NEEDLESS = tuple(topic for topic, rules in NEEDED_BY.items() if not rules)
NEEDED = ((topic,) for topic in NEEDED_BY if topic not in NEEDLESS)
SUBSETS = [NEEDLESS, *NEEDED, tuple(NEEDED_BY)]


@pytest.mark.parametrize("counts", [True, False])
def test_a_rule_is_judged_where_all_its_topics_are_there(
    whole: Path, tmp_path: Path, counts: bool
) -> None:
    for topics in SUBSETS if counts else SUBSETS[::4]:
        opened = read_recording(filtered(whole, tmp_path / "part.mcap", topics, counts))
        found = {verdict.rule: verdict for verdict in judged_recording(opened)}
        lacking = {rule for topic in topics for rule in NEEDED_BY[topic]} if counts else {*ALL}
        assert {rule for rule, of in found.items() if of.lacks_facts} == lacking, topics
        assert all(found[rule].state == HELD for rule in ALL if rule not in lacking), topics
        for topic in topics if counts else ():
            assert all(topic in found[rule].text for rule in NEEDED_BY[topic]), topics


@pytest.mark.parametrize("counts", [True, False])
@pytest.mark.parametrize(
    ("topics", "rules"),
    [
        (["/observed/moves"], OF_ROBOTS),
        (["/observed/book"], OF_THE_DVA),
        (["/story", *(f"/observed/{fact}" for fact in FACTS)], ALL),
    ],
)
def test_check_and_replay_name_the_rules_and_the_missing_topics(
    whole: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    topics: list[str],
    rules: list[str],
    counts: bool,
) -> None:
    file = filtered(whole, tmp_path / "part.mcap", topics, counts)
    lacking = rules if counts else ALL
    code = checks.check([str(file)])
    said = capsys.readouterr().out
    # A file that says how many messages it had is known to have been filtered.
    assert code == (ExitCode.DOES_NOT_HOLD if counts else ExitCode.NOT_JUDGED)
    for rule in rules:
        assert re.search(rf"{rule} not judged: .* /observed/", said), rule
    assert topics[-1] in said
    assert said.count(" not judged: ") == len(lacking)

    console = Console(width=300)
    with console.capture() as captured, pytest.raises(RulesNotJudged) as caught:
        stories.replay(file, Wanted(), where=console)
    assert str(caught.value).endswith(f" {', '.join(lacking)}")
    told = captured.get()
    assert "none was broken" not in told
    assert topics[-1] in told
    assert (" /story" in told) == ("/story" in topics)


def test_a_whole_recording_is_judged(whole: Path, capsys: pytest.CaptureFixture[str]) -> None:
    console = Console(width=300)
    with console.capture() as captured:
        stories.replay(whole, Wanted(), where=console)
    assert "safety rules: none" in captured.get()
    assert checks.check([str(whole)]) == ExitCode.OK
    assert "recording: valid" in capsys.readouterr().out
