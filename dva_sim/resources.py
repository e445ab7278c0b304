"""Find what users edit: worlds, agents, experiments and the protocol, by path or by name."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from dva_sim.errors import ConfigError

_PACKAGE = Path(__file__).parent
FOLDERS = ("protocol", "worlds", "agents", "experiments")
REGISTRATION = ".registration.yaml"  # ending of a file that belongs to the study beside it


def roots() -> list[Path]:
    """Folders that may hold `worlds/`, `agents/`, ...: working folder, source tree, wheel."""
    return [Path.cwd(), *_installed()]


@cache
def _installed() -> tuple[Path, ...]:
    source = _PACKAGE.parent
    tree = (source,) if (source / "pyproject.toml").is_file() else ()
    return *tree, _PACKAGE / "_data"


def available(folder: str, pattern: str = "*.yaml") -> dict[str, Path]:
    """All files of a kind by name; a nearer folder hides a farther one of the same name."""
    names: dict[str, Path] = {}
    for root in roots():
        for path in sorted((root / folder).glob(pattern)):
            if not path.name.endswith(REGISTRATION):
                names.setdefault(path.stem, path)
    return names


def is_there(name: str, folder: str) -> bool:
    """Whether there is a file of that name, without reading whole folders."""
    return any(root.joinpath(folder, f"{name}.yaml").is_file() for root in roots())


def find(name: str, folder: str, suffix: str = ".yaml", base: Path | None = None) -> Path:
    """The file that `name` means: a path (also relative to `base`), or a name in `folder`.

    Args:
        name: `experiments/drive.yaml`, `drive.yaml` or just `drive`.
        folder: Folder below each root, for example `experiments` or `experiments/scenarios`.
        suffix: Ending that a bare name stands for.
        base: Folder of the file that mentions `name`.

    Raises:
        ConfigError: nothing of that name; the message lists what there is.
    """
    for candidate in _candidates(name, folder, suffix, base):
        if candidate.is_file():
            return candidate
    known = sorted(available(folder, f"*{suffix}"))
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    kind = Path(folder).name.removesuffix("s")
    there = ", ".join(known) or "none"
    raise ConfigError(f"{kind} {name!r} not found; {hint}available: {there}")


def _candidates(name: str, folder: str, suffix: str, base: Path | None) -> Iterator[Path]:
    path = Path(name)
    if base is not None and path.suffix:
        yield base / path
    if path.suffix:
        yield path
    for root in roots():
        if path.suffix:
            yield root / path
        yield root / folder / (name if name.endswith(suffix) else name + suffix)
