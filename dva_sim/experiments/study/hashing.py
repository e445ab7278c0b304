"""Hashes of configurations, studies and files, the same on every machine.

A run's numbers depend, besides its configuration, on the program and what users edit.

Which state of the program made some results: commit, and whether anything was changed since.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
from collections import defaultdict
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import dva_sim
from dva_sim.kernel import resources
from dva_sim.kernel.config import Config
from dva_sim.kernel.yaml_files import file_in, texts_in, with_named_files


def stable_hash(data: Any) -> str:
    """Return 64 bits that depend on the data alone, not on the machine or the order of keys."""
    return digest(data)[:16]


def digest(data: Any) -> str:
    """Return all 256 bits of the same."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()


def inputs(scenarios: Iterable[Config], others: Iterable[str] = ()) -> dict[str, str]:
    """Return hashes of the files that scenarios name (maps, traces), and that these name.

    Args:
        scenarios: Scenarios of the runs.
        others: Other files that the runs depend on, as `file.py:Class`.
    """
    return hashes_of(input_names(scenarios, others))


def input_names(scenarios: Iterable[Config], others: Iterable[str] = ()) -> list[str]:
    """Return texts of scenarios, and others, that may name files; see `inputs`."""
    dumps = (scenario.model_dump(mode="json") for scenario in scenarios)
    return sorted({*others, *(text for dump in dumps for text in texts_in(dump) if "." in text)})


def hashes_of(names: Iterable[str]) -> dict[str, str]:
    """Return 64 bits over the contents of each of the `files_of` these names, wherever they lie."""
    contents: dict[str, bytes] = defaultdict(bytes)
    for name, path in files_of(names):
        contents[_placeless(name)] += path.read_bytes()
    return {name: hashlib.sha256(data).hexdigest()[:16] for name, data in contents.items()}


def _placeless(name: str) -> str:
    """Return a name without the folder of an absolute path: results are alike on all machines."""
    path = Path(file_in(name.partition(": ")[0]))
    return name.removeprefix(f"{path.parent}/") if path.is_absolute() else name


def files_of(names: Iterable[str]) -> Iterator[tuple[str, Path]]:
    """Yield name and path of the files of some names, as found now, and of those they name."""
    for name in names:
        yield from _files_of(name)


def _files_of(name: str) -> Iterator[tuple[str, Path]]:
    """Yield the file of a name, which may be a shipped trace, and those that it names.

    A map's image.
    """
    path = Path(file_in(name))
    shipped = (root / _TRACES / path for root in resources.roots())
    file = next(filter(resources.is_file, (path, *shipped)), None)
    if file is None:
        return
    yield name, file
    for other in with_named_files(file)[1:]:
        yield f"{name}: {os.path.relpath(other, file.parent)}", other


# Reports may change without making old runs stale; what measures and simulates may not.
_CODE = (
    "agents",
    "core",
    "network",
    "protocol",
    "simulation",
    "statistics",
    "worlds",
    "kernel/clock.py",
    "kernel/recorder.py",
    "kernel/streams.py",
    "experiments/execution/scheduling.py",
)
# Of these, what holds words that people read, and no run does.
_WORDS = ("agents/operator/published.py", "simulation/labels.py")
# What says whether a hypothesis held: a registration fixes it, other results may be judged again.
_JUDGES = (
    "experiments/analysis/hypothesis_tests.py",
    "experiments/analysis/run_grid.py",
    "experiments/analysis/study_view.py",
    "statistics",
)
_STORMS = ("storms",)
_TRACES = "experiments/traces"
_EDITED = ("agents", "protocol", "worlds")
_SUFFIXES = {".yaml", ".geojson", ".xsd", ".pgm", ".png", ".py"}


def fingerprint() -> str:
    """Return 64 bits over the simulating code and every profile, site and schema within reach."""
    return _hash_of((*_simulating_code(), *_digests(edited_files())))


@cache
def _simulating_code() -> tuple[tuple[str, bytes], ...]:
    """Return digests of the program at the first call.

    Later changes of its files are not loaded.
    """
    return tuple(_digests(_code(_CODE)))


def fingerprint_of_storms() -> str:
    """Return 64 bits over all that a storm plays: what simulates, and what plans and judges it."""
    return _hash_of((*_simulating_code(), *_digests((*_code(_STORMS), *edited_files()))))


def fingerprint_of_judges() -> str:
    """Return 64 bits over the code that comes from tables of runs to verdicts."""
    return _hash_of(_digests(_code(_JUDGES)))


def _digests(files: Iterable[tuple[str, Path]]) -> Iterator[tuple[str, bytes]]:
    for name, path in files:
        yield name, hashlib.sha256(path.read_bytes()).digest()


def _hash_of(digests: Iterable[tuple[str, bytes]]) -> str:
    total = hashlib.sha256()
    for name, digest_of_file in digests:
        total.update(name.encode() + b"\0" + digest_of_file)
    return total.hexdigest()[:16]


def _code(parts: Iterable[str]) -> Iterator[tuple[str, Path]]:
    package = Path(dva_sim.__file__).parent
    for part in parts:
        start = package / part
        for path in sorted(start.rglob("*.py")) if start.is_dir() else [start]:
            name = path.relative_to(package).as_posix()
            if name not in _WORDS:
                yield name, path


def edited_files() -> Iterator[tuple[str, Path]]:
    """Yield profiles, sites and schemas within reach: each name once, from the nearest folder.

    Pictures are left out, as no run reads them.
    """
    seen: dict[str, Path] = {}
    for root in resources.roots():
        for part in _EDITED:
            for path in sorted((root / part).rglob("*")):
                name = path.relative_to(root)
                if path.suffix in _SUFFIXES and "pictures" not in name.parts and path.is_file():
                    seen.setdefault(name.as_posix(), path)
    yield from sorted(seen.items())


def folders_of_files() -> Iterator[Path]:
    """Folders in which a new file would be one of the `edited_files`, or be found by its name."""
    for root in resources.roots():
        yield from (root, root / _TRACES)
        for part in _EDITED:
            yield root / part
            yield from (path for path in sorted((root / part).rglob("*")) if path.is_dir())


@cache
def program_state() -> dict[str, str | bool | None]:
    """Return the state of the running program at the first call; see `state_of`."""
    return state_of(Path(dva_sim.__file__).parent)


def state_of(package: Path) -> dict[str, str | bool | None]:
    """Commit of the checkout that a package stands in, and whether it is `dirty`.

    Dirty is a checkout in which some file of the program, or an agent, site or schema beside
    it, is not as committed, or not committed at all. Results, studies and notes that lie in
    the same checkout do not count. Both are None for an installed program, and where git is
    missing.
    """
    root = package.parent
    if _git(root, "ls-files", "--error-unmatch", f"{package.name}/__init__.py") is None:
        return {"commit": None, "dirty": None}  # installed, perhaps inside a checkout of its user
    parts = [package.name, *(name for name in _EDITED if (root / name).is_dir())]
    changed = _git(root, "status", "--porcelain", "--untracked-files=all", "--", *parts)
    commit = _git(root, "rev-parse", "HEAD")
    return {"commit": commit, "dirty": None if changed is None else bool(changed)}


def _git(folder: Path, *words: str) -> str | None:
    """Return the output of a git command; None if it fails."""
    # A hook that started us names its own repository in the environment.
    environment = {k: v for k, v in os.environ.items() if not k.startswith("GIT_")}
    try:
        done = subprocess.run(
            ["git", "--no-optional-locks", "-C", str(folder), *words],
            capture_output=True,
            text=True,
            env=environment,
            timeout=20,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
