"""A recording that lacks topics: `check` and `replay` say which rules they could not judge."""

from collections.abc import Collection
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from recordings.runs import drive
from rich.console import Console

from dva_sim.cli import checks, stories
from dva_sim.kernel.errors import ExitCode
from dva_sim.recordings.pictures import Wanted
from dva_sim.recordings.writing import COUNTS, write_recording
from dva_sim.simulation.full.episode_measures import tables_of
from dva_sim.simulation.full.verdicts import RulesNotJudged

OF_ROBOTS, OF_THE_DVA = ["S1", "S2", "S3", "S4", "S5"], ["S6", "S7"]
FACTS = ("accepted", "arrived", "book", "heard", "moves", "places")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file, run = tmp_path_factory.mktemp("whole") / "drive.mcap", drive()
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


@pytest.mark.parametrize("counts", [True, False])
@pytest.mark.parametrize(
    ("topics", "rules", "named"),
    [
        (["/observed/moves"], OF_ROBOTS, "/observed/moves"),
        (["/observed/book"], OF_THE_DVA, "/observed/book"),
        (
            ["/story", *(f"/observed/{fact}" for fact in FACTS)],
            [*OF_ROBOTS, *OF_THE_DVA],
            "/observed/book",
        ),
    ],
)
def test_rules_whose_topics_are_missing_are_named(
    whole: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    topics: list[str],
    rules: list[str],
    named: str,
    counts: bool,
) -> None:
    file = filtered(whole, tmp_path / "part.mcap", topics, counts)
    code = checks.check([str(file)])
    said = capsys.readouterr().out
    # A file that says how many messages it had is known to have been filtered.
    assert code == (ExitCode.DOES_NOT_HOLD if counts else ExitCode.NOT_JUDGED)
    for rule in rules:
        assert f"{rule} not judged: the recording lacks /observed/" in said
    assert named in said
    assert said.count(" not judged: the recording lacks") == len(rules)

    console = Console(width=300)
    with console.capture() as captured, pytest.raises(RulesNotJudged) as caught:
        stories.replay(file, Wanted(), where=console)
    assert str(caught.value) == f"facts are missing to judge {', '.join(rules)}"
    told = captured.get()
    assert "none was broken" not in told
    assert named in told
    assert ("the recording lacks /story" in told) == ("/story" in topics)


def test_a_whole_recording_is_judged(whole: Path, capsys: pytest.CaptureFixture[str]) -> None:
    console = Console(width=300)
    with console.capture() as captured:
        stories.replay(whole, Wanted(), where=console)
    assert "safety rules S1 to S7: none was broken" in captured.get()
    assert checks.check([str(whole)]) == ExitCode.OK
    assert "recording: valid" in capsys.readouterr().out
