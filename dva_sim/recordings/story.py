"""What is told and said in a recording: the story, the messages, commands, what screens show."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from dva_sim.agents.camera import Frame
from dva_sim.recorder import Sent
from dva_sim.recordings import messages
from dva_sim.recordings.messages import XML, Message
from dva_sim.simulation import Playback

STORY, MESSAGES = "/story", "/messages"
SCREEN, COMMANDS, CAMERA = "screen", "commands", "camera"  # last parts of topics
LEVELS = {"safety": 3, "mode": 1, "link": 1}  # of Foxglove's log; all else is for information


def told(playback: Playback) -> Iterator[Message]:
    """The timeline."""
    for moment in playback.recorder.timeline:
        content = {
            "timestamp": messages.stamp(moment.time),
            "level": LEVELS.get(moment.kind, 2),
            "message": moment.what,
            "name": moment.who,
            "file": "",
            "line": 0,
            "kind": moment.kind,
        }
        yield Message(moment.time, STORY, "foxglove.Log", content)


def said(playback: Playback) -> Iterator[Message]:
    """All messages as they went onto the network; of a camera's frame, what it stands for."""
    names = names_of(playback.labels)
    for sent in playback.recorder.traffic or ():
        if isinstance(sent.payload, Frame):
            yield _frame(sent, names)
        else:
            topic = f"{MESSAGES}/{names[sent.source]}/{names[sent.destination]}"
            yield Message(sent.time, topic, XML, sent.payload)


def names_of(labels: Mapping[str, str]) -> dict[str, str]:
    """A name for each id that fits into a topic, and that no other id has."""
    names: dict[str, str] = {}
    for device, label in labels.items():
        name = label.replace(" ", "-")
        taken = name in names.values()
        names[device] = f"{name}-{device.replace(':', '')}" if taken else name
    return names


def shown(playback: Playback) -> Iterator[Message]:
    """The frames that come onto the operators' screens."""
    labels = playback.labels
    for number, drive in enumerate(playback.recorder.drives):
        for frame in drive.frames:
            content = {
                "timestamp": messages.stamp(frame.time),
                "drive": number,
                "robot": labels[drive.robot],
                "captured_s": frame.captured,
            }
            topic = f"/{labels[drive.operator]}/{SCREEN}"
            yield Message(frame.time, topic, "dva_sim.Shown", content)


def commanded(playback: Playback) -> Iterator[Message]:
    """What the phones make of the tilt."""
    labels = playback.labels
    for number, drive in enumerate(playback.recorder.drives):
        for time, speed, turn_rate in drive.commands:
            content = {
                "timestamp": messages.stamp(time),
                "drive": number,
                "robot": labels[drive.robot],
                "speed_m_s": round(speed, 5),
                "turn_rate_rad_s": round(turn_rate, 5),
            }
            topic = f"/{labels[drive.operator]}/{COMMANDS}"
            yield Message(time, topic, "dva_sim.Command", content)


def applied(playback: Playback) -> Iterator[Message]:
    """What the robots make of the commands."""
    for drive in playback.recorder.drives:
        for a in drive.applied:
            content = {
                "timestamp": messages.stamp(a.time),
                "made_s": a.issued,
                "sent_s": a.sent,
                "arrived_s": a.arrived,
                "until_s": messages.finite(a.until),
                "captured_s": messages.finite(a.captured),
            }
            topic = f"/{playback.labels[drive.robot]}/applied"
            yield Message(a.time, topic, "dva_sim.Applied", content)


def _frame(sent: Sent, names: Mapping[str, str]) -> Message:
    frame: Frame = sent.payload
    seen = frame.observation
    content: dict[str, Any] = {
        "timestamp": messages.stamp(sent.time),
        "to": names[sent.destination],
        "size_bytes": sent.size,
        "captured_s": frame.captured,
        "x_m": round(seen.x, messages.PLACES),
        "y_m": round(seen.y, messages.PLACES),
        "heading_rad": round(seen.heading, messages.PLACES),
        "visibility_m": round(seen.visibility, 2),
        "hazards": [
            {"kind": h.kind, "x_m": round(h.x, 2), "y_m": round(h.y, 2)} for h in seen.hazards
        ],
    }
    return Message(sent.time, f"/{names[sent.source]}/{CAMERA}", "dva_sim.Frame", content)
