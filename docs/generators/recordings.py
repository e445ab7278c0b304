"""The page of the recording format: topics, and the fields of each kind of message."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.resources import files
from typing import NamedTuple

from generators.markdown import code, sentence, table
from generators.markdown import page as page_of

_HEAD = """\
A recording is an MCAP file. Foxglove, PlotJuggler and other viewers open it. Its clock is virtual
and begins at zero; the same seed gives the same bytes. A recording of a live run has the same form
with real times. Attached are the scenario with all its keys, the site, the tables of measures
(`tables.json`) and what a player needs (`run.json`). The metadata `dva-sim` hold the version, the
seed and the run's place in its study. `read_recording(path)` of `dva_sim.recordings.reading` reads
a file in Python."""


class Topic(NamedTuple):
    """A topic, with `NAME` for the label of a robot or a person."""

    name: str
    schema: str
    content: str


TOPICS = (
    Topic("/story", "foxglove.Log", "timeline of the run"),
    Topic("/NAME/pose", "foxglove.PoseInFrame", "pose, ten times a second while it changes"),
    Topic("/tf", "foxglove.FrameTransforms", "poses of all that moved"),
    Topic("/NAME/activity", "dva_sim.Activity", "mode of a robot or activity of a person"),
    Topic("/NAME/fix", "foxglove.LocationFix", "latitude and longitude of a robot, each second"),
    Topic("/NAME/seen", "foxglove.PoseInFrame", "pose of a robot as its operator believes it"),
    Topic("/NAME/commands", "dva_sim.Command", "commands of an operator's phone, as made"),
    Topic("/NAME/applied", "dva_sim.Applied", "commands as a robot applied them"),
    Topic("/NAME/camera", "dva_sim.Frame", "frames as a robot sent them: what is in view"),
    Topic("/NAME/screen", "dva_sim.Shown", "frames as an operator's screen showed them"),
    Topic("/NAME/image", "foxglove.CompressedImage", "drawn pictures; only while Foxglove watches"),
    Topic("/messages/FROM/TO", "dva", "each message as sent: XML by `protocol/dva.xsd`"),
    Topic("/scene", "foxglove.SceneUpdate", "walls, bodies and hazards to draw"),
    Topic("/plan", "foxglove.GeoJSON", "plan of the site"),
    Topic("/hazards", "dva_sim.Hazard", "state of each hazard, each second"),
    Topic("/fields/WHAT", "foxglove.Grid", "smoke, heat, gas or water over the floor, every 2 s"),
    Topic("/facts", "dva_sim.Fact", "decisions of people, the policy and rules"),
    Topic("/audit", "dva_sim.Audited", "rows of the console's audit log"),
    Topic("/events", "dva_sim.Event", "state of each event; only while Foxglove watches"),
    Topic(
        "/latencies",
        "dva_sim.Latency",
        "delay of commands and pictures; only while Foxglove watches",
    ),
    Topic("/decisions/NAME", "dva_sim.Decision", "trace of the DVA or a robot, in live runs"),
    Topic("/observed/arrived", "dva_sim.Arrived", "messages as robots and the DVA received them"),
    Topic("/observed/heard", "dva_sim.Heard", "devices whose heartbeats the DVA received"),
    Topic("/observed/accepted", "dva_sim.Accepted", "commands that a robot accepted"),
    Topic("/observed/by_hand", "dva_sim.ByHand", "manual control at a robot"),
    Topic("/observed/moves", "dva_sim.MotionNews", "motion of robots and set points of motors"),
    Topic("/observed/places", "dva_sim.PlaceNews", "positions of robots and guards"),
    Topic("/observed/book", "dva_sim.BookNews", "changes of the DVA's events and permissions"),
    Topic("/observed/deaf", "dva_sim.Deafened", "a robot's computer hangs, or runs again"),
    Topic("/observed/slowed", "dva_sim.Slowed", "processing time of a robot, when it changes"),
    Topic("/observed/gap", "dva_sim.FactGap", "number of facts that were not kept"),
)


def page() -> str:
    """Return the page in Markdown."""
    return page_of(
        "Recording format",
        _HEAD,
        "## Topics",
        "The safety rules are judged from the topics below `/observed`.",
        table(
            ["topic", "schema", "content"],
            ([code(t.name), code(t.schema), sentence(t.content)] for t in TOPICS),
        ),
        "## Schemas",
        "Units stand at the end of a field's name. `maybe` is a number or null; `*` marks a list.",
        table(["schema", "meaning", "fields"], _schemas()),
    )


def _schemas() -> Iterator[list[str]]:
    text = files("dva_sim.recordings").joinpath("schemas.txt").read_text(encoding="utf-8")
    for block in text.replace("----\n", "").split("\n\n"):
        head, _, fields = block.strip().partition("\n")
        name, _, meaning = head.partition(" | ")
        if name:
            rows = (f"`{' '.join(each.split())}`" for each in fields.split(";"))
            yield [code(name), sentence(meaning), "; ".join(rows)]
