"""What a result may be called: declared beforehand, explored, or a confirmation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from pydantic import Field

from dva_sim.experiments.execution.limit import RunTooLong
from dva_sim.experiments.study.hashing import fingerprint_of_judges
from dva_sim.kernel.config import Config


class Status(Config):
    """What a result may be called, and why; the manifest holds it, the report shows it.

    Attributes:
        kind: `declared`: run as its file says, nothing registered. `exploratory`: something was
            changed, tried or left open. `confirmatory`: run as registered, on seeds that nobody
            could know before.
        why: Reasons and remarks, each a sentence without its full stop.
        reproducible: Whether the same command gives the same bytes on any machine.
        registration: What was registered, whether or not this is it; None if nothing was.
    """

    kind: Literal["declared", "exploratory", "confirmatory"] = "declared"
    why: tuple[str, ...] = ()
    reproducible: bool = True
    registration: dict[str, Any] | None = Field(default=None)


def status_of(manifest: Mapping[str, Any]) -> Status:
    """What the result may be called; results that do not say are judged by what was set.

    A confirmation has all the runs that were registered. Runs that took too long are others on
    another machine. Verdicts are made anew whenever they are told, by the program as it is then.
    """
    if "status" in manifest:
        manifest = _marked_partial(manifest)
        status = Status.model_validate(manifest["status"])
        return _judged_anew(_without(manifest.get("failures", []), status))
    changes = [_as_words(change) for change in manifest.get("set", [])]
    if not changes:
        return Status(kind="declared")
    return Status(kind="exploratory", why=(f"changed on the command line: {', '.join(changes)}",))


def _marked_partial(manifest: Mapping[str, Any]) -> Mapping[str, Any]:
    """The manifest, whose status says so if the study is not finished."""
    if "partial" not in manifest:
        return manifest
    why = ("the study is not finished", *manifest["status"]["why"])
    found = {"kind": "exploratory", "why": why, "reproducible": False}
    return {**manifest, "status": {**manifest["status"], **found}}


def _judged_anew(status: Status) -> Status:
    """The status, with a word if hypotheses are judged by another program than was registered."""
    meant = (status.registration or {}).get("judged_with")
    if not meant or meant == (now := fingerprint_of_judges()):
        return status
    remark = f"what judges its hypotheses has changed since it was registered ({meant}; now {now})"
    return status.model_copy(update={"why": (*status.why, remark)})


def _without(failed: Sequence[Mapping[str, Any]], status: Status) -> Status:
    """The status of results in which some runs are missing."""
    if not failed:
        return status
    confirmed = status.kind == "confirmatory"
    slow = sum(str(row["error"]).startswith(RunTooLong.__name__) for row in failed)
    why = []
    if confirmed:
        why.append(f"{len(failed)} of the registered runs failed")
    if slow:
        why.append(f"{slow} of the runs met their limit of time; on another machine others may")
    return status.model_copy(
        update={
            "kind": "exploratory" if confirmed else status.kind,
            "why": (*why, *status.why),
            "reproducible": status.reproducible and not slow,
        }
    )


def _as_words(change: Any) -> str:
    """One `--set`, however the manifest keeps it."""
    return change if isinstance(change, str) else "=".join(str(word) for word in change)
