"""The records of an MCAP file as they stand there, sorted a little; and whether it is ours."""

from __future__ import annotations

import json
import os
import struct
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import IO, Any

from dva_sim.recordings import channels, messages
from dva_sim.recordings.messages import XML
from dva_sim.recordings.writing import ABOUT, COUNTS, DIGEST, RUN, SCENARIO, digest

LARGEST = 2**31  # maximum size of a record; a larger one is damaged [B]
NO_END = "is damaged: it does not end as MCAP does"
PACKED = {
    b"\x28\xb5\x2f\xfd": "zstd",
    b"\x1f\x8b": "gzip",
    b"\x04\x22\x4d\x18": "lz4",
    b"\xfd7zXZ": "xz",
    b"BZh": "bzip2",
    b"PK\x03\x04": "zip",
}  # how files begin that were compressed as a whole
_DAMAGED = (
    *(ValueError, KeyError, TypeError, struct.error),  # of fields that do not belong together
    *(OverflowError, MemoryError, RecursionError),  # of lengths and depths that nothing has
)
CUT = "is damaged, or was cut short before anything of the run"


class _Exactly:
    """A file that gives as many bytes as are asked for, or says that it ends early."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._left = file.seek(0, os.SEEK_END)
        file.seek(0)

    def read(self, length: int) -> bytes:
        """Return the next bytes; no memory is taken for more than there are."""
        from mcap.exceptions import EndOfFile

        self._left -= length
        if self._left < 0:
            raise EndOfFile
        return self._file.read(length)


class DamagedError(Exception):
    """The file does not contain the bytes that were written to it."""


@dataclass
class RawRecords:
    """Records of a file, grouped by kind.

    Attributes:
        made_by: The profile and the library that its head names.
        about: Its metadata, if they are ours.
        files: Attached files, by name.
        contents: Content of the messages, with their time [s], by topic.
        ends: Source and destination of the channels of XML, by topic.
        order: Facts and messages in the order of the file: time [s], topic, content.
        time: Time of the last message [s].
        is_cut: True if the end of the file is missing.
        written: Number of messages written on each topic; empty if the file does not say.
        found: Number of messages found on each topic.
    """

    made_by: tuple[str, str] = ("", "")
    about: dict[str, str] | None = None
    files: dict[str, bytes] = field(default_factory=dict)
    contents: dict[str, list[tuple[float, Any]]] = field(default_factory=lambda: defaultdict(list))
    ends: dict[str, dict[str, str]] = field(default_factory=dict)
    order: list[tuple[float, str, Any]] = field(default_factory=list)
    time: float = 0.0
    is_cut: bool = False
    written: dict[str, int] = field(default_factory=dict)
    found: Counter[str] = field(default_factory=Counter)

    def read(self, file: IO[bytes]) -> None:
        """Read records up to the end of the file, expected or not.

        Raises:
            DamagedError: something else than an early end.
        """
        from mcap.exceptions import EndOfFile, InvalidMagic, McapError
        from mcap.records import Channel
        from mcap.stream_reader import StreamReader
        from zstandard import ZstdError

        channels: dict[int, Channel] = {}
        source: Any = _Exactly(file)
        reader = StreamReader(source, validate_crcs=True, record_size_limit=LARGEST)
        try:
            for record in reader.records:
                self._take(record, channels)
        except EndOfFile:
            self.is_cut = True
        except InvalidMagic:
            file.seek(0)
            raise DamagedError(_other_form(file.read(8)) if not self.files else NO_END) from None
        except (McapError, ZstdError, *_DAMAGED) as error:
            raise DamagedError(f"is damaged: {' '.join(str(error).split())[:200]}") from None
        if self.about is None and not self.is_cut:
            raise DamagedError(self._not_ours())
        if self.about is None or digest(self.files) != self.about.get(DIGEST):
            raise DamagedError(CUT if self.is_cut else self._incomplete())

    def _not_ours(self) -> str:
        """Describe a complete file without our metadata."""
        if channels.HAZARDS in self.contents or any(map(is_camera, self.contents)):
            return self._filtered("metadata")
        profile, library = (f"{text!r:.60}" for text in self.made_by)
        return (
            f"is an MCAP file, but no recording of dva-sim (profile {profile}, library {library})"
        )

    def _incomplete(self) -> str:
        """Return why the data that accompany the messages are incomplete."""
        if self.files.keys() < {RUN, SCENARIO}:
            return self._filtered("attachments")
        return "is damaged: something is missing or changed"

    def _filtered(self, what: str) -> str:
        by = f" by {self.made_by[1]!r:.60}" if self.made_by[1] else ""
        return f"was filtered{by}, without its {what}; keep metadata and attachments when filtering"

    def _take(self, record: Any, opened: dict[int, Any]) -> None:
        from mcap.records import Attachment, Channel, Header, Message, Metadata

        if isinstance(record, Header):
            self.made_by = record.profile, record.library
        elif isinstance(record, Message):
            channel = opened[record.channel_id]
            self.found[channel.topic] += 1
            is_xml = channel.message_encoding == XML
            self.time = record.log_time / messages.NS
            is_json = channel.message_encoding == "json"
            content = json.loads(record.data) if is_json else record.data
            self.contents[channel.topic].append((self.time, content))
            if is_xml or channel.topic.startswith(channels.OBSERVED) or is_camera(channel.topic):
                self.order.append((self.time, channel.topic, content))
        elif isinstance(record, Channel):
            opened[record.id] = record
            if record.metadata:
                self.ends[record.topic] = dict(record.metadata)
        elif isinstance(record, Attachment):
            self.files[record.name] = record.data
        elif isinstance(record, Metadata) and record.name == ABOUT:
            self.about = dict(record.metadata)
        elif isinstance(record, Metadata) and record.name == COUNTS:
            self.written = {topic: int(count) for topic, count in record.metadata.items()}


def _other_form(head: bytes) -> str:
    """Describe a file that does not begin like an MCAP file."""
    if how := next((name for magic, name in PACKED.items() if head.startswith(magic)), None):
        return f"is compressed as a file ({how}); unpack it first"
    return "is not a recording: it does not begin as MCAP does"


def is_camera(topic: str) -> bool:
    """Return True if a topic holds camera pictures of a robot."""
    return topic.endswith(f"/{channels.CAMERA}")
