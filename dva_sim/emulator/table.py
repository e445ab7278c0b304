"""A table of measurements that grows by whole rows, also when its writer is killed."""

from __future__ import annotations

import csv
import fcntl
import io
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from dva_sim.errors import ConfigError


class Table:
    """A CSV file of one campaign, and beside it the machine it was measured on.

    A row is one write that is forced to the disk; what a killed writer left of a row is cut off
    when the file is opened again. Only one campaign can write to it.

    Args:
        path: The file; made if it is not there.
        columns: Its columns.

    Raises:
        ConfigError: it cannot be written, has other columns, or another campaign writes to it.
    """

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self.path = path
        self.columns = tuple(columns)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        except OSError as error:
            raise ConfigError(f"cannot be written: {error.strerror}", path) from None
        try:
            self.rows = self._take_over()
        except BaseException:
            os.close(self._file)
            raise

    def __enter__(self) -> Table:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.close(self._file)

    def append(self, row: Mapping[str, str]) -> None:
        """Add a row."""
        self._write([row[column] for column in self.columns])
        self.rows.append(dict(row))

    def sign(self, machine: Mapping[str, Any]) -> None:
        """Say which machine measures.

        Raises:
            ConfigError: rows of another one are there already.
        """
        beside = self.path.with_suffix(".machine.json")
        if self.rows and beside.exists():
            known = json.loads(beside.read_text(encoding="utf-8"))
            other = [name for name in machine if known.get(name) != machine[name]]
            if other:
                told = ", ".join(f"{n} was {known.get(n)}, is {machine[n]}" for n in other)
                raise ConfigError(f"was measured elsewhere ({told}): begin another file", self.path)
        beside.write_text(json.dumps(machine, indent=1) + "\n", encoding="utf-8")

    def _take_over(self) -> list[dict[str, str]]:
        """Lock the file, cut off half a row, write the header where it is new; its rows."""
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ConfigError("is being written by another campaign", self.path) from None
        content = self.path.read_bytes()
        whole = content.rfind(b"\n") + 1
        os.ftruncate(self._file, whole)
        if not whole:
            self._write(self.columns)
            return []
        reader = csv.DictReader(io.StringIO(content[:whole].decode()))
        if tuple(reader.fieldnames or ()) != self.columns:
            raise ConfigError("is not a table of measurements: other columns", self.path)
        return list(reader)

    def _write(self, values: Sequence[str]) -> None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(values)
        os.write(self._file, text.getvalue().encode())
        os.fsync(self._file)
