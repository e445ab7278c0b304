"""Damage by structure: values to extremes, other types, keys dropped and doubled, depth, bytes."""

from __future__ import annotations

import copy
import json
import math
import re
import sqlite3
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from random import Random
from typing import Any

MARKUP = "<script>alert(1)</script>"
FORMULA = '=HYPERLINK("http://example.org")'
TURNED = "\u202eegnellahc"  # shown from right to left
TEXTS = (
    MARKUP,
    FORMULA,
    TURNED,
    "",
    " ",
    "a" * 5000,
    "a" * 1_000_000,
    "\ud800",  # half a character
    "[" * 20_000,
    "../../x",
    "\x1b[31m",
    "a\nb",
    "nan",
    "1e400",
)
NUMBERS = (
    *(0, -0.0, -1, 1e-320, 1e19, 1e300, -1e300, 2**31, 2**63, -(2**63), 2**64, 10**400),
    *(math.inf, -math.inf, math.nan),
)
OTHERS = (None, True, [], {}, [[]], {"": None})
DEPTH = 10_000

Mutation = Callable[[bytes, Random], bytes]


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path of each value in plain data."""
    if path:
        yield path
    inner = value.items() if isinstance(value, dict) else ()
    inner = enumerate(value) if isinstance(value, list) else inner
    for key, each in inner:
        yield from places(each, (*path, key))


def a_value(rng: Random, old: Any) -> Any:
    """Draw a value that nobody would write; often one near the old."""
    near = [old * 10**6, -old, old // 7, old + 1] if type(old) in (int, float) else [old, [old]]
    return rng.choice(rng.choice([TEXTS, NUMBERS, NUMBERS, OTHERS, near]))


def tree(data: Any, rng: Random) -> Any:
    """Return plain data with one to three places changed."""
    data = copy.deepcopy(data)
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        paths = list(places(data))
        if not paths:
            return a_value(rng, data)
        path = rng.choice(paths)
        holder = data
        for key in path[:-1]:
            holder = holder[key]
        kind = rng.randrange(10)
        if kind == 0:
            del holder[path[-1]]
        elif kind == 1 and isinstance(holder, dict):
            holder[rng.choice([*TEXTS[:4], f"{path[-1]}x"])] = holder.pop(path[-1])
        elif kind == 3 and isinstance(holder[path[-1]], str):
            numbers = map(str, (rng.choice(NUMBERS), 2**32 - 1))
            holder[path[-1]] = within(holder[path[-1]], rng, "\\d+", rng.choice([*numbers]))
        elif kind == 2 and isinstance(holder, list):
            holder += holder[: 1000 // (len(holder) or 1)]
        else:
            holder[path[-1]] = a_value(rng, holder[path[-1]])
    return data


def within(text: str, rng: Random, pattern: str, new: str) -> str:
    """Put something in the place of one of the parts of a text that have a form."""
    spans = [found.span() for found in re.finditer(pattern, text)]
    start, end = rng.choice(spans or [(len(text), len(text))])
    return text[:start] + new + text[end:]


def raw(data: bytes, rng: Random) -> bytes:
    """Flip, cut, double or insert some bytes."""
    at = rng.randrange(len(data) + 1)
    to = min(len(data), at + rng.choice([1, 8, 64]))
    noise = rng.choice([b"\xff" * 8, b"\0" * 8, b"9" * 400, rng.randbytes(8)])
    return rng.choice(
        [
            data[:at],
            data[:at] + data[to:],
            data[:at] + noise[: to - at] + data[to:],
            data[:at] + data[at:to] * 3 + data[to:],
            data[:at] + noise + data[at:],
        ]
    )


def of_json(data: bytes, rng: Random) -> bytes:
    """Damage a JSON file by its values; YAML readers take it, too."""
    if rng.random() < 0.1:
        return raw(data, rng)
    text = json.dumps(tree(json.loads(data), rng))
    kind = rng.random()
    if kind < 0.05:
        deep = "[" * DEPTH + "]" * DEPTH
        deep = rng.choice([deep, '{"a":' * DEPTH + "1" + "}" * DEPTH])
        text = within(text, rng, r"\bnull\b|\btrue\b|\b\d+\b|\"[^\"]*\"(?!:)", deep)
    elif kind < 0.1:  # a key that is there twice
        again = json.dumps(a_value(rng, 1))
        text = re.sub(r'("[^"]*"): ', lambda key: f"{key[0]}{again}, {key[0]}", text, count=1)
    return text.encode()


def of_yaml(data: bytes, rng: Random) -> bytes:
    """Damage a YAML file by its values."""
    from dva_sim.kernel.yaml_files import _read

    return of_json(json.dumps(_read(data.decode())[0]).encode(), rng)


def of_lines(data: bytes, rng: Random) -> bytes:
    """Damage text in columns or `key = value`: a value, a line, or bytes."""
    if rng.random() < 0.3:
        return raw(data, rng)
    lines = data.decode("utf-8", "replace").split("\n")
    at = rng.randrange(len(lines))
    if rng.random() < 0.3:
        return "\n".join(rng.choice([lines[:at] + lines[at + 1 :], lines[:at] * 2])).encode()
    sign = next((sign for sign in (",", "=", " ") if sign in lines[at]), " ")
    cells = lines[at].split(sign)
    cells[rng.randrange(len(cells))] = str(rng.choice([*NUMBERS, *TEXTS]))
    text = "\n".join([*lines[:at], sign.join(cells), *lines[at + 1 :]])
    return text.encode("utf-8", "surrogatepass")


def of_jsonl(data: bytes, rng: Random, most: int = 12) -> bytes:
    """Draw some lines of JSON, and damage half of them."""
    lines = data.splitlines()
    at = rng.randrange(len(lines))
    drawn = (lines[at:] + lines[:at])[: rng.randrange(1, most)]
    return b"\n".join(of_json(line, rng) if rng.random() < 0.5 else line for line in drawn)


def of_sqlite(data: bytes, rng: Random) -> bytes:
    """Damage a database: a cell, a table, or bytes."""
    if rng.random() < 0.2:
        return raw(data, rng)
    with tempfile.NamedTemporaryFile() as file:
        Path(file.name).write_bytes(data)
        with closing(sqlite3.connect(file.name, isolation_level=None)) as db:
            db.execute("PRAGMA journal_mode=DELETE")
            triggers = "SELECT name FROM sqlite_master WHERE type = 'trigger'"
            for (trigger,) in db.execute(triggers).fetchall():  # which guard against just that
                db.execute(f'DROP TRIGGER "{trigger}"')
            found = db.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
            full = [t for (t,) in found if db.execute(f'SELECT 1 FROM "{t}"').fetchone()]
            table = rng.choice(full)
            rows = db.execute(f'SELECT rowid, * FROM "{table}"').fetchall()
            names = [row[1] for row in db.execute(f'PRAGMA table_info("{table}")')]
            number, *values = rng.choice(rows)
            at = rng.randrange(len(names))
            old = values[at]
            try:
                new = of_json(str(old).encode(), rng).decode()
            except ValueError:
                new = a_value(rng, old)
            new = new if type(new) in (int, float, str, bytes, type(None)) else str(new)
            try:
                where = f'UPDATE "{table}" SET "{names[at]}" = ? WHERE rowid = ?'
                db.execute(where, [new, number])
            except (sqlite3.Error, OverflowError, UnicodeEncodeError):
                db.execute(f'DELETE FROM "{table}" WHERE rowid = ?', [number])
        return Path(file.name).read_bytes()


def of_image(data: bytes, rng: Random) -> bytes:
    """Damage the bytes of an image, or draw noise in shades of grey instead."""
    if rng.random() < 0.5:
        return raw(data, rng)
    import numpy as np

    width, height = (rng.choice([1, 60, 400, 900, 2000]) for _ in range(2))
    is_free = np.random.default_rng(rng.randrange(2**32)).random((height, width)) < rng.random()
    head = rng.choice([b"P5 %d %d 255\n", b"P5 %d0 %d 255\n", b"P5 %d %d00000 255\n"])
    return head % (width, height) + np.where(is_free, 254, 0).astype(np.uint8).tobytes()


def of_mcap(data: bytes, rng: Random) -> bytes:
    """Damage a recording: JSON within it, which is compressed and sealed again, or bytes."""
    from io import BytesIO

    from mcap.records import Attachment, Channel, Message, Metadata, Schema
    from mcap.stream_reader import StreamReader
    from mcap.writer import CompressionType, Writer

    from dva_sim.recordings.writing import ABOUT, DIGEST, digest

    if rng.random() < 0.3:
        return raw(data, rng)
    records = list(StreamReader(BytesIO(data)).records)
    holders = [r for r in records if isinstance(r, Message | Attachment) and r.data[:1] == b"{"]
    chosen = rng.choice(holders)
    chosen.data = of_json(chosen.data, rng)
    files = {r.name: r.data for r in records if isinstance(r, Attachment)}
    out = BytesIO()
    writer = Writer(out, compression=rng.choice(list(CompressionType)))
    writer.start("dva_sim")
    schemas, channels = {0: 0}, {}
    for r in records:
        if isinstance(r, Schema):
            schemas[r.id] = writer.register_schema(r.name, r.encoding, r.data)
        elif isinstance(r, Channel):
            given = r.topic, r.message_encoding, schemas[r.schema_id], r.metadata
            channels[r.id] = writer.register_channel(*given)
        elif isinstance(r, Message):
            times = r.log_time, r.data, r.publish_time, r.sequence
            writer.add_message(channels[r.channel_id], *times)
        elif isinstance(r, Attachment):
            writer.add_attachment(r.create_time, r.log_time, r.name, r.media_type, r.data)
        elif isinstance(r, Metadata):
            sealed = {DIGEST: digest(files)} if r.name == ABOUT else {}
            writer.add_metadata(r.name, r.metadata | sealed)
    writer.finish()
    return out.getvalue()


def of_parquet(data: bytes, rng: Random) -> bytes:
    """Damage a table of results: a column of other values or of another type, or bytes."""
    import duckdb

    if rng.random() < 0.3:
        return raw(data, rng)
    with tempfile.TemporaryDirectory() as folder:
        old, new = Path(folder, "old.parquet"), Path(folder, "new.parquet")
        old.write_bytes(data)
        db = duckdb.connect()
        names = [row[0] for row in db.execute(f"DESCRIBE FROM '{old}'").fetchall()]
        name = rng.choice(names)
        text = rng.choice(["NULL", "'NaN'::DOUBLE", "1e300", "-1", "9223372036854775807", "true"])
        text = rng.choice([text, f"'{MARKUP}'", f"'{FORMULA}'", f"'{TURNED}'"])
        change = rng.choice([f'REPLACE ({text} AS "{name}")', f'EXCLUDE "{name}"'])
        db.execute(f"COPY (SELECT * {change} FROM '{old}') TO '{new}'")
        return new.read_bytes()
