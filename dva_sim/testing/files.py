"""A file's kind, its mistakes, and the schema of files of its kind."""

from __future__ import annotations

import json
import re
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.suggestions import hint
from dva_sim.kernel.yaml_files import Document, load_yaml
from dva_sim.protocol.limits import schema_file
from dva_sim.protocol.mistakes import READ_BYTES, Problem, check_message, not_text

if TYPE_CHECKING:  # late: start-up
    from dva_sim.simulation.full.verdicts import Verdict

YAML_BYTES: Final = 256 * 1024
PLAN_BYTES: Final = 16 * 1024 * 1024
_SUFFIXES: Final = {
    ".xml": "message",
    ".geojson": "plan",
    ".json": "plan",
    ".yaml": "configuration",
    ".yml": "configuration",
    ".mcap": "recording",
    ".part": "recording",
    ".jsonl": "trace",
    ".sqlite": "audit log",
    ".up": "recorded link",
    ".down": "recorded link",
}
_UNKNOWN: Final = (
    "cannot be recognised; should be a message (.xml), a plan (.geojson), a recording (.mcap), "
    "a trace of decisions (.jsonl), an audit log (.sqlite), a recorded link (.up, .down, or a log "
    "of delays), or a study, scenario, site, ROS map or agent profile (.yaml)"
)


_RECORDED: Final = (
    b"\x89MCAP",
    *(b"\x28\xb5\x2f\xfd", b"\x1f\x8b", b"\x04\x22\x4d\x18"),  # compressed: zstd, gzip, lz4
)
_OF_LINK: Final = re.compile(
    rb"(\xef\xbb\xbf|#[^\n]*\n|\s)*(\d[\d.]*[\s,;]*(\d[\d.]*|-|\*|lost|nan)?\r?\n|PING "
    rb"|\[\d[\d.]*\] [^\n]*icmp_seq=|[^\n{<]*(rtt|delay|latency|throughput|bps)[^\n:]*\r?\n)",
    re.IGNORECASE,
)
_IPERF: Final = b'"bits_per_second"'


class NotReadError(DvaSimError):
    """There is no file to judge, or it cannot be read."""


@dataclass(frozen=True)
class FileVerdict:
    """Result of checking a file: its kind, problems and contradictory settings.

    It is valid if it has no problems, and breaks no rule. A note says how much was looked at.
    """

    kind: str
    problems: list[Problem]
    doubts: Sequence[str] = ()
    note: str = ""
    rules: Sequence[Verdict] = ()

    @property
    def broken(self) -> int:
        """Return the number of safety rules that are broken."""
        return len({verdict.rule for verdict in self.rules if verdict.is_broken})

    @property
    def unjudged(self) -> str:
        """Return the safety rules that lack facts in a line; empty: none."""
        if not self.rules:
            return ""
        from dva_sim.simulation.full.verdicts import unjudged_rules  # late: start-up

        return unjudged_rules(self.rules)


def check_file(path: Path) -> FileVerdict:
    """Judge one file.

    Raises:
        NotReadError: not there, not a file, or not readable.
    """
    kind = _SUFFIXES.get(path.suffix.lower())
    if kind is None or path.suffix.lower() == ".json":
        kind = _by_content(_read(path, READ_BYTES)) or kind
    if kind == "message":
        return FileVerdict(kind, check_message(_read(path, READ_BYTES)))
    if kind == "plan":
        return _check_plan(path)
    if kind == "configuration":
        return _check_yaml(path)
    if kind in _EVIDENCE:
        return _check_evidence(kind, path)
    return FileVerdict("unknown", [Problem(1, 1, _UNKNOWN)])


def _by_content(head: bytes) -> str | None:
    """Recognise a file by its content when its name does not tell."""
    text = head.lstrip()
    if text.startswith(b"<"):
        return "message"
    if head.startswith(b"SQLite format 3\0"):
        return "audit log"
    if head.startswith(_RECORDED):
        return "recording"
    if text.startswith(b"{"):
        features = b'"FeatureCollection"' in text
        return "plan" if features else "recorded link" if _IPERF in text else None
    return "recorded link" if _OF_LINK.match(text) else None


def _read(path: Path, limit: int) -> bytes:
    """Return the first bytes of a file; never waits for a pipe, and never reads more than asked."""
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
    """List problems visible before parsing."""
    data = _read(path, limit + 1)
    if not data.strip():
        return [Problem(1, 1, "is empty")]
    if len(data) > limit:
        return [Problem(1, 1, f"is too large; should have at most {limit} bytes")]
    problem = not_text(data)
    return [problem] if problem else []


def _check_plan(path: Path) -> FileVerdict:
    from dva_sim.testing.file_kinds import check_plan  # late: start-up
    from dva_sim.worlds.geojson import doubts_of_plan  # late: start-up

    problems = _flawed(path, PLAN_BYTES) or check_plan(path)
    return FileVerdict("plan", problems, () if problems else doubts_of_plan(path))


_EVIDENCE: Final = {
    "recording": "check_recording",
    "trace": "check_trace",
    "audit log": "check_audit_log",
    "recorded link": "check_recorded_link",
}  # how each is judged


def _check_evidence(kind: str, path: Path) -> FileVerdict:
    from dva_sim.testing import evidence  # late: start-up

    _read(path, 1)
    return FileVerdict(kind, *getattr(evidence, _EVIDENCE[kind])(path))


def _check_yaml(path: Path) -> FileVerdict:
    """Return the class, imported here: messages need nothing that reads configurations."""
    from dva_sim.experiments.study.file_kinds import recognise  # late: start-up
    from dva_sim.testing.file_kinds import KINDS as FILES  # late: start-up
    from dva_sim.testing.file_kinds import check_config, doubts, notes  # late: start-up

    problems = _flawed(path, YAML_BYTES)
    document, problem = (None, problems[0]) if problems else _parse(path)
    if document is None:
        return FileVerdict("configuration", [problem] if problem else [])
    kind = recognise(document, FILES)
    if kind is None:
        return FileVerdict("unknown", [Problem(1, 1, _UNKNOWN)])
    problems = check_config(kind, document)
    if problems:
        return FileVerdict(kind.name, problems)
    return FileVerdict(kind.name, [], doubts(kind, document), notes(kind, document))


def _parse(path: Path) -> tuple[Document | None, Problem | None]:
    """Return the document, or why there is none."""
    try:
        return load_yaml(path), None
    except ConfigError as error:
        return None, Problem(error.line or 1, error.column or 1, error.problem)


KINDS: Final = ("message", "study", "scenario", "cases", "site", "agent")
_FILES: Final[dict[str, tuple[str, ...]]] = {
    "study": ("study",),
    "scenario": ("scenario", "timed scenario", "task", "transports", "middleware"),
    "cases": ("validation cases",),
    "site": ("site",),
}  # by their names; an agent is whatever lies in a folder of agents
_KEYS: Final = "Attributes"  # section of a model's description with its keys
_KEY: Final = re.compile(r"^ {4}(?P<key>\w+): (?P<text>.*(?:\n {5,}.*)*)", re.MULTILINE)
_DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"


def schema_text(kind: str) -> str:
    """Return the schema of a kind of file.

    Raises:
        ConfigError: no such kind.
    """
    if kind == "message":
        return schema_file().read_text(encoding="utf-8")
    if kind in KINDS:
        schema = {"$schema": _DIALECT} | _json_schema(kind)
        for model in (schema, *schema.get("$defs", {}).values()):
            _describe_keys(model)
        return json.dumps(schema, indent=2) + "\n"
    raise ConfigError(f"no schema {kind!r}; {hint(kind, KINDS, 'there are')}")


def _describe_keys(model: dict[str, Any]) -> None:
    """Give each key what its model's description says of it, so that editors can show it."""
    text, _, rest = model.get("description", "").partition(f"\n\n{_KEYS}:\n")
    if not rest:
        return
    model["description"] = text
    for match in _KEY.finditer(rest.partition("\n\n")[0]):
        if match["key"] in model.get("properties", {}):
            model["properties"][match["key"]]["description"] = " ".join(match["text"].split())


def _json_schema(kind: str) -> dict[str, Any]:
    """Return the schema from the models that read the files; some kinds have several."""
    from pydantic import TypeAdapter

    from dva_sim.testing.file_kinds import KINDS as FILES  # late: start-up

    models = [
        file.model
        for file in FILES
        if file.name in _FILES.get(kind, ()) or file.folder.startswith(f"{kind}s/")
    ]
    return TypeAdapter[Any](reduce(or_, models)).json_schema()
