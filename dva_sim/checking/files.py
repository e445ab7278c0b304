"""One file: what kind it is of, and what is wrong with it."""

from __future__ import annotations

import stat
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from dva_sim.checking.messages import READ_BYTES, check_message
from dva_sim.checking.problem import Problem, not_text
from dva_sim.config import Document, load_yaml
from dva_sim.errors import ConfigError, DvaSimError

YAML_BYTES: Final = 256 * 1024
PLAN_BYTES: Final = 16 * 1024 * 1024
_SUFFIXES: Final = {
    ".xml": "message",
    ".geojson": "plan",
    ".json": "plan",
    ".yaml": "configuration",
    ".yml": "configuration",
}
_UNKNOWN: Final = (
    "cannot be recognised; should be a message (.xml), a plan (.geojson), or a study, scenario, "
    "site, ROS map or agent profile (.yaml)"
)


class NotReadError(DvaSimError):
    """There is no file to judge, or it cannot be read."""


@dataclass(frozen=True)
class Verdict:
    """What was found: the kind of a file, its problems, and what does not go together in it.

    It is valid if it has no problems.
    """

    kind: str
    problems: list[Problem]
    doubts: Sequence[str] = ()


def check_file(path: Path) -> Verdict:
    """Judge one file.

    Raises:
        NotReadError: not there, not a file, or not readable.
    """
    kind = _SUFFIXES.get(path.suffix.lower()) or _by_content(_read(path, READ_BYTES))
    if kind == "message":
        return Verdict(kind, check_message(_read(path, READ_BYTES)))
    if kind == "plan":
        return _check_plan(path)
    if kind == "configuration":
        return _check_yaml(path)
    return Verdict("unknown", [Problem(1, 1, _UNKNOWN)])


def _by_content(head: bytes) -> str | None:
    """What a file without a telling name holds."""
    text = head.lstrip()
    if text.startswith(b"<"):
        return "message"
    return "plan" if text.startswith(b"{") and b'"FeatureCollection"' in text else None


def _read(path: Path, limit: int) -> bytes:
    """The first bytes of a file; never waits for a pipe, and never reads more than asked."""
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise NotReadError("is a folder; give the files in it")
        if not stat.S_ISREG(mode):
            raise NotReadError("is not a file; a message may come through -")
        with path.open("rb") as file:
            return file.read(limit)
    except FileNotFoundError:
        raise NotReadError("is not there") from None
    except OSError as error:
        raise NotReadError(f"cannot be read: {error.strerror}") from None


def _flawed(path: Path, limit: int) -> list[Problem]:
    """What is wrong before anything is parsed."""
    data = _read(path, limit + 1)
    if not data.strip():
        return [Problem(1, 1, "is empty")]
    if len(data) > limit:
        return [Problem(1, 1, f"is too large; should have at most {limit} bytes")]
    problem = not_text(data)
    return [problem] if problem else []


def _check_plan(path: Path) -> Verdict:
    from dva_sim.checking.configs import check_plan

    return Verdict("plan", _flawed(path, PLAN_BYTES) or check_plan(path))


def _check_yaml(path: Path) -> Verdict:
    """A message needs none of what reads configurations: it is imported here."""
    from dva_sim.checking.configs import check_config, doubts
    from dva_sim.experiments.documents import recognise

    problems = _flawed(path, YAML_BYTES)
    document, problem = (None, problems[0]) if problems else _parse(path)
    if document is None:
        return Verdict("configuration", [problem] if problem else [])
    kind = recognise(document)
    if kind is None:
        return Verdict("unknown", [Problem(1, 1, _UNKNOWN)])
    problems = check_config(kind, document)
    return Verdict(kind.name, problems, () if problems else doubts(kind, document))


def _parse(path: Path) -> tuple[Document | None, Problem | None]:
    """The document, or why there is none."""
    try:
        return load_yaml(path), None
    except ConfigError as error:
        return None, Problem(error.line or 1, error.column or 1, error.problem)
