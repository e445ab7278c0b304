"""Addresses of cells and runs: their places in a study, in tables, manifests and names of files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

REFERENCE = -1


class Address(NamedTuple):
    """Address of a run, or of a cell, which has neither person nor trial.

    Attributes:
        part: Name of the part.
        cell: Position of the cell in the design, or `REFERENCE`.
        person: Index of the simulated person, from 0.
        trial: Index of the trial, from 0.
    """

    part: str
    cell: int
    person: int | None = None
    trial: int | None = None

    @classmethod
    def of(cls, row: Mapping[str, Any]) -> Self:
        """Return the address in a row of a table or of a manifest's cells."""
        return cls(row["part"], row["cell"], row.get("person"), row.get("trial"))

    @classmethod
    def all_of(cls, table: Mapping[str, Any]) -> list[Self]:
        """Return addresses of all rows of a table, given by its columns."""
        return list(map(cls, *(table[name].tolist() for name in cls._fields)))

    def __str__(self) -> str:
        """Return the text as in names of files: `drive-3-0-1`, or `drive-reference-0-1`."""
        cell = "reference" if self.cell == REFERENCE else self.cell
        return "-".join(map(str, (self.part, cell, *(n for n in self[2:] if n is not None))))
