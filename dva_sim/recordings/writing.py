"""A run as an MCAP file: the same run makes the same bytes, and a file is whole or not there.

The site goes with it as files, and is made from them again.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any

import numpy as np

from dva_sim import __version__
from dva_sim.core.events import Event
from dva_sim.kernel import resources
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.resources import refuse_to_replace
from dva_sim.recordings import channels, messages
from dva_sim.recordings.messages import SCHEMAS, XML, ChannelMessage
from dva_sim.simulation.full import Playback
from dva_sim.simulation.full.hazards import RunHazard
from dva_sim.simulation.full.observations import terms_of
from dva_sim.simulation.full.run import FILM_PERIOD
from dva_sim.simulation.scenario import Scenario, site_of
from dva_sim.worlds.hazards import KINDS
from dva_sim.worlds.maps import FREE, OCCUPIED, UNKNOWN, UNKNOWN_SHADE
from dva_sim.worlds.site import Site
from dva_sim.worlds.site_export import write_site

SHADES = {FREE: 254, OCCUPIED: 0, UNKNOWN: UNKNOWN_SHADE}
NO_SITE = "its site is missing"


def pack(site: Site) -> dict[str, bytes]:
    """Return a site's files by name: YAML and GeoJSON of a plan, YAML and PNG of a bare map."""
    if not site.rooms:
        return _map_files(site)
    with TemporaryDirectory() as folder:
        write_site(site, Path(folder))
        return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}


def unpack(files: Mapping[str, bytes], scenario: Scenario, seed: int) -> Site:
    """Return the site, even if its own files have changed since.

    Args:
        files: From `pack`.
        scenario: Scenario that was run; for a bare map it gives the number of bases.
        seed: Seed that places those bases.

    Raises:
        ConfigError: the files do not hold a site.
        ValueError: there is none.
    """
    name = next((name for name in files if name.endswith(".yaml")), None)
    if name is None:
        raise ValueError(NO_SITE)
    with TemporaryDirectory() as folder:
        for each, data in files.items():
            (Path(folder) / Path(each).name).write_bytes(data)
        path = str(Path(folder) / Path(name).name)
        key = "name" if scenario.site.map is None else "map"
        named = scenario.site.model_copy(update={key: path, "options": {}})
        return site_of(scenario.model_copy(update={"site": named}), seed)


def _map_files(site: Site) -> dict[str, bytes]:
    """Return a bare map in ROS map_server form, with the cells unchanged."""
    from PIL import Image

    grid = site.grid
    shades = np.zeros(256, np.uint8)
    for cell, shade in SHADES.items():
        shades[cell] = shade
    picture = io.BytesIO()
    Image.fromarray(shades[grid.cells[::-1]]).save(picture, "PNG")
    text = (
        f"image: {site.name}.png\nmode: trinary\nresolution: {grid.resolution!r}\n"
        f"origin: [{grid.origin.x!r}, {grid.origin.y!r}, {grid.origin.heading!r}]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return {f"{site.name}.yaml": text.encode(), f"{site.name}.png": picture.getvalue()}


FORMAT = 1  # version of the attachments; a reader refuses a later one
COUNTS = "dva-sim messages"  # metadata: messages per topic, by which filtering is detected
ABOUT = "dva-sim"  # name of the metadata
DIGEST = "digest"  # key of the metadata
RUN = "run.json"
SCENARIO = "scenario.json"
TABLES = "tables.json"
SITE = "site/"
# Attributes kept of a hazard whose class a reader does not load.
DESCRIBED = ("title", "shows", "colour", "mark")
HELD_TO = "held_to"  # key of the limits of robots, recorded together with the facts
SENT = ("responder", "operator", "actor")  # attributes of an event that name the devices sent there
DRIVE = ("robot", "operator", "event", "ordered_s", "started_s", "ended_s", "outcome")
SUFFIX = ".mcap"  # ending of a recording
PART = ".part"  # ending of what a live run assembles until its end
CHUNK = 256 * 1024  # maximum loss in a truncated file, unpacked [B]

Tables = Mapping[str, Any]


def check_target(path: Path, overwrite: bool = False, **remedy: str) -> None:
    """Tell what keeps a recording from being made there, before anything is run.

    Args:
        path: Path of the recording.
        overwrite: True to replace an existing file.
        remedy: See `refuse_to_replace`.

    Raises:
        ConfigError: its name does not say what it is, something is there, or nothing can be
            written.
    """
    if path.suffix.lower() != SUFFIX:
        raise ConfigError(f"--record: recording should end in {SUFFIX}, not {path.name!r}")
    if not path.parent.is_dir():
        raise ConfigError(f"folder {str(path.parent)!r} for the recording does not exist")
    if path.is_dir():
        raise ConfigError("is a folder; give the name of a file", path)
    refuse_to_replace([path], overwrite, **remedy)
    try_to_write(path.parent)


def check_both(target: Path, overwrite: bool) -> None:
    """Tell what keeps a recording from being made, before anything is run.

    Args:
        target: The recording.
        overwrite: It, and the lines that an earlier run left, may be replaced.

    Raises:
        ConfigError: either is there, or nothing can be written.
    """
    part = target.with_name(target.name + PART)
    remedy = f"dva-sim replay {part} --mcap NAME keeps it; give another name, or --overwrite"
    refuse_to_replace([part], overwrite, remedy)
    check_target(target, overwrite)


def try_to_write(folder: Path) -> None:
    """See whether a folder takes files.

    Raises:
        ConfigError: it does not.
    """
    path = _beside(folder / "probe")
    try:
        path.write_bytes(b"is there room?")
        path.unlink()
    except OSError as error:
        with suppress(OSError):
            path.unlink()
        why = error.strerror
        raise ConfigError(f"nothing can be written in folder {str(folder)!r}: {why}") from error


def write_recording(
    playback: Playback,
    path: Path,
    *,
    tables: Tables | None = None,
    about: Mapping[str, str] | None = None,
    traces: Mapping[str, Sequence[tuple[float, str]]] | None = None,
    audit: Sequence[tuple[float, Mapping[str, Any]]] = (),
) -> None:
    """Write a run as MCAP, in its time from zero.

    Args:
        playback: The run, simulated with `keep_traffic`.
        path: Output file; an existing one is replaced once all is written.
        tables: Measures as rows by table; stored as JSON.
        about: More to say of the run, such as its place in a study.
        traces: Decisions as lines with their time [s], by author.
        audit: Rows of an audit log, with their time [s].

    Raises:
        DvaSimError: the file cannot be written.
        ValueError: the run was made without `keep_traffic`.
    """
    if playback.recorder.traffic is None:
        raise ValueError("a recording needs a run with keep_traffic")
    with whole_file(path) as file:
        decided = [*channels.decided(traces or {}), *channels.audited(audit)]
        _write(playback, file, tables, dict(about or {}), decided)


def _beside(path: Path) -> Path:
    """Return the temporary file in which a file is written before it replaces the target."""
    return path.with_name(f".{path.name}.{os.getpid()}")


@contextmanager
def whole_file(path: Path) -> Iterator[IO[bytes]]:
    """Yield a file beside `path` that replaces `path` on success, and is removed otherwise.

    Raises:
        DvaSimError: it cannot be written.
    """
    part = _beside(path)
    try:
        with part.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        raise DvaSimError(f"{path} cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)


def every_message(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield all messages of a recording, grouped by subject, not by time."""
    yield from channels.ground(playback)
    yield from channels.activities(playback)
    yield from channels.bodies(playback)
    yield from channels.hazards(playback)
    yield from channels.states(playback)
    yield from channels.grids(playback)
    yield from channels.poses(playback)
    yield from channels.beliefs(playback)
    yield from channels.fixes(playback)
    yield from channels.story_messages(playback)
    yield from channels.facts(playback)
    yield from channels.commanded(playback)
    yield from channels.network_messages(playback)
    yield from channels.applied(playback)
    yield from channels.shown(playback)


def _write(
    playback: Playback,
    file: IO[bytes],
    tables: Tables | None,
    about: Any,
    decided: Sequence[ChannelMessage],
) -> None:
    from mcap.writer import Writer

    writer: Any = Writer(file, chunk_size=CHUNK, enable_data_crcs=True)
    writer.start(profile="", library=f"dva-sim {__version__}")
    files = pack(playback.site)
    attached = {SCENARIO: _json(playback.scenario.model_dump(mode="json"))}
    attached[RUN] = _json(facts(playback))
    attached |= {} if tables is None else {TABLES: _json(_plain(tables))}
    attached |= {SITE + name: data for name, data in files.items()}
    # What stands here at the beginning is there even if the end of the file is not.
    writer.add_metadata(ABOUT, _about(playback) | about | {DIGEST: digest(attached)})
    for name, data in attached.items():
        kinds = {
            ".json": "application/json",
            ".geojson": "application/geo+json",
            ".png": "image/png",
        }
        writer.add_attachment(0, 0, name, kinds.get(Path(name).suffix, "application/yaml"), data)
    _add_messages(writer, playback, files, decided)
    writer.finish()


def schema_of_channel(name: str) -> tuple[str, str, bytes]:
    """Return name, encoding and text of the schema that a channel's messages have."""
    if name == XML:
        return "dva", "xsd", resources.find("dva", "protocol", ".xsd").read_bytes()
    return name, "jsonschema", _json(SCHEMAS[name])


def _add_messages(
    writer: Any, playback: Playback, files: Mapping[str, bytes], decided: Sequence[ChannelMessage]
) -> None:
    """Add all messages in order of time; schemas and channels are opened when first used."""
    ids = {name: device for device, name in channels.names_of(playback.labels).items()}
    counts: Counter[str] = Counter()

    @cache
    def schema_of(name: str) -> int:
        return int(writer.register_schema(*schema_of_channel(name)))

    @cache
    def channel_of(topic: str, schema: str) -> int:
        number = schema_of(schema)
        if schema != XML:
            return int(writer.register_channel(topic, "json", number, {}))
        source, destination = (ids[name] for name in topic.split("/")[-2:])
        ends = {"source": source, "destination": destination}
        return int(writer.register_channel(topic, XML, number, ends))

    answer_text = chain(every_message(playback), decided)
    every = [packed(message) for message in answer_text]
    plan = next((data for name, data in files.items() if name.endswith(".geojson")), None)
    if plan is not None:
        plan_message = ChannelMessage(0.0, "/plan", "foxglove.GeoJSON", {"geojson": plan.decode()})
        every.insert(0, packed(plan_message))
    for time, topic, schema, data in sorted(every, key=lambda entry: entry[0]):
        channel = channel_of(topic, schema)
        counts[topic] += 1
        writer.add_message(channel, time, data, time, counts[topic])
    writer.add_metadata(COUNTS, {topic: str(count) for topic, count in sorted(counts.items())})


def packed(message: ChannelMessage) -> tuple[int, str, str, bytes]:
    """Return a message's time [ns], topic, schema and content, as a file and a viewer get it."""
    content = message.content if message.schema == XML else _json(message.content)
    return messages.nanoseconds(message.time), message.topic, message.schema, content


# --- what goes with it -----------------------------------------------------------------
def digest(files: Mapping[str, bytes]) -> str:
    """Return the digest of all that accompanies the messages, to detect damage."""
    whole = hashlib.sha256()
    for name, data in files.items():
        whole.update(f"{name}:{len(data)}:".encode() + data)
    return whole.hexdigest()


def facts(playback: Playback) -> dict[str, Any]:
    """Return the metadata that a player needs besides the messages."""
    return {
        "format": FORMAT,
        "seed": playback.seed,
        "duration_s": playback.duration,
        "sampled_s": FILM_PERIOD,
        "labels": playback.labels,
        "radii_m": playback.radii,
        "incidents": [_incident(incident) for incident in playback.incidents],
        "contained_s": {str(number): time for number, time in playback.contained.items()},
        "endings": [
            {"outcome": ending.outcome, "time_s": messages.finite(ending.time)}
            for ending in playback.endings
        ],
        "events": [_event(event) for event in playback.events],
        "drives": [
            {key: getattr(drive, key.removesuffix("_s")) for key in DRIVE}
            for drive in playback.recorder.drives
        ],
        **({} if playback.recorder.facts is None else {HELD_TO: _held_to(playback)}),
    }


def _held_to(playback: Playback) -> dict[str, Any]:
    """Return the limits of the robots: their profiles may be files that a reader lacks."""
    return playback.about_robots or terms_of(playback.scenario).about_robots()


def _event(event: Event) -> dict[str, Any]:
    """Return an event as the DVA knew it in the end; the times say how it stood before."""
    return {
        "number": event.number,
        "kind": event.kind,
        "latitude_deg": event.position.latitude,
        "longitude_deg": event.position.longitude,
        "severity": event.severity,
        "state": event.state.value,
        **{role: getattr(event, role) for role in SENT},
        "times_s": event.times,
    }


def _incident(incident: RunHazard) -> dict[str, Any]:
    hazard = incident.hazard
    described = {name: getattr(hazard, name) for name in DESCRIBED}
    is_shipped = type(hazard) is KINDS[incident.kind]
    return {
        "kind": incident.kind,
        "room": incident.room,
        "start_s": incident.start,
        "detected_s": messages.finite(incident.detected),
        "false_alarm": incident.false_alarm,
        "hazard": hazard.model_dump(mode="json"),
        **({} if is_shipped else {"described": described}),
    }


def _about(playback: Playback) -> dict[str, str]:
    return {
        "version": __version__,
        "format": str(FORMAT),
        "seed": str(playback.seed),
        "site": playback.site.name,
        "duration_s": f"{playback.duration:g}",
        "time": "virtual, from the start of the run",
    }


def _plain(value: Any) -> Any:
    """Return tables for JSON: a missing or infinite number is null."""
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _json(data: Any) -> bytes:
    return json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
