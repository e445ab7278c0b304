"""Answers of published studies, kept beside them with the manifests that they came from.

An answer is dated: it names the program, the seed, the size and the status it was found with, and
holds digests of a few of its runs, by which any later program can tell whether it still gives them.
An answer that is replaced moves to a table of history.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from dva_sim.experiments.analysis.choice_map import ChoiceMap
from dva_sim.experiments.analysis.predictions import judge_all
from dva_sim.experiments.execution.checkpoint import load_so_far
from dva_sim.experiments.execution.sampled_runs import Digests, SampledRun
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.choice_table import beside_table, choice_table
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.manifest import manifest_of, status_of
from dva_sim.experiments.study.plan import StudyPlan
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.whole_files import write_whole

FOLDER = "answers"
HISTORY = "history.csv"
_MANIFEST = ".manifest.json"


Table = tuple[tuple[str, ...], ...]
_ASKED = {
    "study": "the study's file",
    "scenarios": "a scenario",
    "parameter_sets": "a model of the persons",
    "tuned": "a tuned value",
    "cells": "a configuration",
}


@dataclass(frozen=True)
class AnswerRow:
    """The contrast at one level: first minus second, with the edges of its 95 % band."""

    level: str | float | bool | None
    mean: float
    low: float
    high: float


@dataclass(frozen=True)
class KeptAnswer:
    """Stored answer of a published study.

    Attributes:
        study: Name of the study.
        question: Question of the study.
        answer: The answer in words, as its report begins; never compared.
        measure: Column that was compared; empty without a contrast.
        contrast: Its two levels in words.
        over: Factor that the rows run over.
        rows: The contrast at each level.
        predictions: Predictions, each with its verdict.
        hypotheses: Names of hypotheses with their verdicts.
        status: `declared`, `confirmatory` or `exploratory`.
        version: Version of the program.
        commit: Its commit.
        date: Start of the run, as `YYYY-MM-DD`.
        seed: The study's.
        persons: Number of simulated persons.
        runs: Number of runs.
        cpu_s: Cost of the runs [CPU s].
        tables: SHA-256 of each table of results.
        sampled: Digests of a few runs; empty where runs are measured in real time.
        stale_since: Version that first gave something else; empty while it is still given.
        map: Table of a choice map, its heads first; empty without one.
        beside: Table of what runs are like in each of its cells, likewise.
    """

    study: str
    question: str
    answer: str
    measure: str
    contrast: tuple[str, str] | None
    over: str
    rows: tuple[AnswerRow, ...]
    predictions: tuple[tuple[str, str], ...]
    hypotheses: tuple[tuple[str, str], ...]
    status: str
    version: str
    commit: str
    date: str
    seed: int
    persons: int
    runs: int
    cpu_s: float
    tables: Mapping[str, str]
    sampled: Digests = field(default_factory=dict)
    stale_since: str = ""
    map: Table = ()
    beside: Table = ()


def answer_in(folder: Path) -> tuple[KeptAnswer, dict[str, Any]]:
    """Return the answer that a results folder gives, without digests of runs, and its manifest.

    Raises:
        ConfigError: the folder holds no results, or a study that is not finished or has failed
            runs, one in which a safety rule was broken, or one that was run with settings or in
            another size than its file has.
    """
    reading = Reading(load_so_far(folder))
    manifest = dict(reading.manifest)
    study = reading.study
    if reading.results.partial or manifest.get("failures"):
        raise ConfigError(f"{folder}: only a study that is finished without failed runs is kept")
    if reading.broken:
        raise ConfigError(f"{folder}: safety rules were broken in {reading.broken}")
    if manifest.get("set"):
        raise ConfigError(f"{folder}: was run with --set {' '.join(manifest['set'])}")
    usual = manifest["usual"]
    if any(study.get(key) != usual.get(key) for key in ("persons", "replications", "factors")):
        raise ConfigError(f"{folder}: was run in another size than that of its study's file")
    machine = json.loads((folder / "machine.json").read_text(encoding="utf-8"))
    versions = manifest["versions"]
    finding = reading.finding
    if versions.get("dirty"):
        raise ConfigError(f"{folder}: was run by a program with changes that are not committed")
    answer = KeptAnswer(
        study=str(manifest["usual"]["name"]),
        question=str(manifest["question"]),
        answer=reading.answer.lead,
        measure=finding.measure if finding else "",
        contrast=(str(finding.first), str(finding.second)) if finding else None,
        over=finding.over if finding else "",
        rows=_rows(reading),
        predictions=tuple((p.text, p.verdict) for p in judge_all(study, reading.view)),
        hypotheses=tuple((t.name, t.verdict) for t in reading.judgement.tested),
        status=status_of(manifest).kind,
        version=str(versions["dva-sim"]),
        commit=str(versions.get("commit") or ""),
        date=str(machine["started"])[:10],
        seed=int(manifest["seeds"]["study"]),
        persons=reading.persons,
        runs=int(manifest["runs"]),
        cpu_s=float(machine["cpu_s"]),
        tables=dict(manifest["tables"]),
        map=_table(reading, choice_table),
        beside=_table(reading, beside_table),
    )
    return answer, manifest


def _table(reading: Reading, of_map: Callable[[ChoiceMap, str], CellTable]) -> Table:
    if reading.map is None:
        return ()
    cells = of_map(reading.map, "")
    return tuple(map(tuple, (cells.heads, *cells.rows)))


def changed_since(manifest: Mapping[str, Any], study: Study) -> str:
    """Return the changes of a study since it was run, in words; empty if there are none.

    The question may be worded otherwise: no run depends on it.

    Args:
        manifest: Manifest of the run.
        study: The study as its file is now.
    """
    now = json.loads(json.dumps(manifest_of(StudyPlan.of(study))))
    for key, what in _ASKED.items():
        if _without_question(manifest.get(key)) != _without_question(now[key]):
            return what
    before = manifest.get("inputs", {})
    files = now["inputs"]
    return next((f for f in sorted(before.keys() & files) if before[f] != files[f]), "")


def _without_question(data: Any) -> Any:
    if not isinstance(data, Mapping):
        return data
    return {key: value for key, value in data.items() if key != "question"}


def refuse_other_runs(folder: Path, sampled: Sequence[SampledRun]) -> None:
    """Refuse a results folder whose runs this program no longer reproduces.

    Raises:
        ConfigError: the study's file has changed since, or what simulates has.
    """
    runs = load_so_far(folder).runs
    places = {key: n for n, key in enumerate(zip(runs["config"], runs["seed"], strict=True))}
    for job, _, row in sampled:
        address = places.get(job.key)
        if address is None:
            if job.is_repeat:
                continue
            raise ConfigError(f"{folder}: has no run {job.address} as it is now")
        columns = [c for c, value in row.items() if not _is_equal(runs[c][address], value)]
        if columns:
            where = f"{columns[0]} of run {job.address}"
            raise ConfigError(f"{folder}: this program gives another {where}; run the study again")


def _is_equal(cell: Any, value: Any) -> bool:
    """Return True if a table's cell equals a value; a missing value is NaN."""
    if value is None or value != value:
        return cell is None or cell != cell
    return bool(cell == value)


def _rows(reading: Reading) -> tuple[AnswerRow, ...]:
    finding = reading.finding
    if finding is None:
        return ()
    columns = (finding.mean.tolist(), finding.low.tolist(), finding.high.tolist())
    levels = finding.levels if finding.over else (None,)
    return tuple(AnswerRow(*row) for row in zip(levels, *columns, strict=True))


def keep(answer: KeptAnswer, manifest: Mapping[str, Any], folder: Path) -> Path:
    """Write an answer and its manifest; one with other numbers that was there becomes history.

    Args:
        answer: The answer.
        manifest: Manifest of the results.
        folder: Folder of the kept answers.

    Returns:
        The answer's file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{answer.study}.json"
    if file.exists() and not _is_same(before := read(file), answer):
        _append(before, folder / HISTORY)
    write_whole(folder / f"{answer.study}{_MANIFEST}", _text(manifest))
    write_whole(file, _text(asdict(answer)))
    return file


def _is_same(before: KeptAnswer, answer: KeptAnswer) -> bool:
    """Return True if two answers of a version give the same numbers for the same contrast."""
    names = "version", "status", "measure", "contrast", "over", "rows", "stale_since"
    return all(getattr(before, name) == getattr(answer, name) for name in names)


def _text(data: Mapping[str, Any]) -> str:
    return json.dumps(data, indent=1, ensure_ascii=False) + "\n"


_COLUMNS = ("study", "version", "date", "status", "level", "mean", "low", "high", "stale_since")


def _append(answer: KeptAnswer, file: Path) -> None:
    """Add a line for each level of an answer that is replaced."""
    before = file.read_text(encoding="utf-8") if file.exists() else ",".join(_COLUMNS) + "\n"
    text = io.StringIO()
    writer = csv.DictWriter(text, _COLUMNS, lineterminator="\n", extrasaction="ignore")
    writer.writerows(
        asdict(answer)
        | {
            key: f"{value:.4g}" if isinstance(value, float) else value
            for key, value in asdict(row).items()
        }
        for row in answer.rows
    )
    write_whole(file, before + text.getvalue())


def read(file: Path) -> KeptAnswer:
    """Read an answer.

    Raises:
        ConfigError: the file cannot be read, or is not an answer.
    """
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        rows = tuple(AnswerRow(**row) for row in data["rows"])
        lists = ("predictions", "hypotheses", "map", "beside")
        pairs = {key: tuple(map(tuple, data.get(key, ()))) for key in lists}
        contrast = tuple(data["contrast"]) if data["contrast"] else None
        # Up to 0.9.0 a part and a number stood before CONFIG/SEED.
        named = {"/".join(k.split("/")[-2:]): v for k, v in data.get("sampled", {}).items()}
        read = {"rows": rows, "contrast": contrast, "sampled": named}
        return KeptAnswer(**data | read | pairs)
    except OSError as error:
        raise ConfigError(f"{file} cannot be read: {error.strerror}") from None
    except (ValueError, TypeError, KeyError) as error:
        raise ConfigError(f"{file} is not a kept answer: {error}") from None


def read_manifest(study: str, folder: Path) -> dict[str, Any]:
    """Read the manifest that is kept beside the answer of a study.

    Raises:
        ConfigError: the file cannot be read, or is not a manifest.
    """
    file = folder / f"{study}{_MANIFEST}"
    try:
        return dict(json.loads(file.read_text(encoding="utf-8")))
    except OSError as error:
        raise ConfigError(f"{file} cannot be read: {error.strerror}") from None
    except (ValueError, TypeError) as error:
        raise ConfigError(f"{file} is not a manifest: {error}") from None


def mark_stale(answer: KeptAnswer, version: str, folder: Path) -> None:
    """Note that a version no longer gives an answer."""
    marked = replace(answer, stale_since=version)
    write_whole(folder / f"{answer.study}.json", _text(asdict(marked)))


def all_kept(folder: Path) -> list[KeptAnswer]:
    """Return every answer that is kept in a folder, in the order of the studies' names."""
    files = [file for file in sorted(folder.glob("*.json")) if not file.name.endswith(_MANIFEST)]
    return [read(file) for file in files]
