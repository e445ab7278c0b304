"""The versions of a study beside the one its file describes, and what `run` is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from dva_sim.errors import ConfigError

Version = Literal["quick", "full"]
VERSIONS: tuple[Version, ...] = ("quick", "full")
SIZES: dict[Version, str] = {"quick": "small", "full": "larger"}


@dataclass(frozen=True)
class Variant:
    """Which variant of a study is meant.

    Attributes:
        version: The small or the larger version; None for the study as its file says.
        pilot: Only so many persons.
    """

    version: Version | None = None
    pilot: int | None = None

    @classmethod
    def of(cls, *, quick: bool, full: bool, pilot: int | None) -> Variant:
        """The variant that the options `--quick`, `--full` and `--pilot` ask for.

        Raises:
            ConfigError: both versions are asked for.
        """
        if quick and full:
            raise ConfigError("--quick and --full are two versions of a study; give one of them")
        return cls("quick" if quick else "full" if full else None, pilot)

    def folder(self, name: str) -> Path:
        """Where results go if nobody says: each variant has its own folder."""
        marks = [self.version or "", "pilot" if self.pilot is not None else ""]
        return Path("results") / "-".join([Path(name).stem, *filter(None, marks)])
