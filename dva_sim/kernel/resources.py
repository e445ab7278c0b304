"""Search for the files that users edit: worlds, agents, experiments and the protocol."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import guess, hint

_PACKAGE = Path(__file__).parent.parent
REGISTRATION = ".registration.yaml"  # ending of a registration, stored beside its study
_RESULTS = "manifest.json"  # file in a results folder
_TEXTS: Final = (".yaml", ".yml", ".csv", ".xsd")  # files that a name may mean


class FolderKind(NamedTuple):
    """Contents of a resource folder.

    Attributes:
        word: Noun for such a file in messages.
        command: Command that takes such files, if any.
    """

    word: str
    command: str = ""


KINDS: Final = {
    "experiments": FolderKind("study", "dva-sim run"),
    "experiments/scenarios": FolderKind("scenario", "dva-sim episode"),
    "experiments/validation": FolderKind("file"),
    "worlds": FolderKind("site", "dva-sim site show"),
    "agents/robots": FolderKind("robot"),
    "agents/ros": FolderKind("robot of ROS"),
    "agents/phones": FolderKind("phone"),
    "agents/accelerometers": FolderKind("accelerometer"),
    "agents/people": FolderKind("profile of people"),
}


def roots() -> list[Path]:
    """Return the folders that may hold `worlds/`, `agents/` and so on, in order of precedence.

    They are the working folder, the source tree and the installed package.
    """
    return [Path.cwd(), *_installed()]


@cache
def _installed() -> tuple[Path, ...]:
    source = _PACKAGE.parent
    tree = (source,) if (source / "pyproject.toml").is_file() else ()
    return *tree, _PACKAGE / "_data"


def available(folder: str, pattern: str = "*.yaml") -> dict[str, Path]:
    """Return all files of a kind by name; of files with the same name, that of the first root."""
    names: dict[str, Path] = {}
    for root in roots():
        for path in sorted((root / folder).glob(pattern)):
            if not path.name.endswith(REGISTRATION):
                names.setdefault(path.stem, path)
    return names


def is_there(name: str, folder: str) -> bool:
    """Return True if there is a file of that name, without reading whole folders."""
    return any(is_file(root.joinpath(folder, f"{name}.yaml")) for root in roots())


def find(
    name: str,
    folder: str,
    suffix: str = ".yaml",
    base: Path | None = None,
    is_asked: bool = False,
) -> Path:
    """Return the file for a name: a path (also relative to `base`), or a name in `folder`.

    Args:
        name: `experiments/drive.yaml`, `drive.yaml` or just `drive`.
        folder: Folder below each root, for example `experiments` or `experiments/scenarios`.
        suffix: Ending that is added to a bare name.
        base: Folder of the file that mentions `name`.
        is_asked: True if a user named the file on the command line, perhaps with the wrong command.

    Raises:
        ConfigError: there is no such file; the message suggests a name or lists all.
    """
    for candidate in _candidates(name, folder, suffix, base):
        if is_file(candidate):
            return candidate
    raise ConfigError(_missing(name, folder, sorted(available(folder, f"*{suffix}")), is_asked))


def _missing(name: str, folder: str, names: list[str], is_asked: bool) -> str:
    """Describe a missing file: suggest files of the same or a similar name, or list all."""
    kind = KINDS.get(folder, FolderKind(Path(folder).name.removesuffix("s"))).word
    path = Path(name)
    other_kinds = {where: k for where, k in KINDS.items() if where != folder}
    if name and _is_there(path.is_dir):
        if is_file(path / _RESULTS):
            return f"{name!r} is a results folder, not a {kind}; try: dva-sim show {path}"
        return f"{name!r} is a folder; give the file of a {kind}, or its name"
    for where, other_kind in other_kinds.items():
        if is_there(name, where):
            use = f"; try: {other_kind.command} {name}" if other_kind.command and is_asked else ""
            return f"{name!r} is a {other_kind.word}, not a {kind}{use}"
    if path.suffix or len(path.parts) > 1:
        return f"file {name!r} not found{_meant(path, kind, names)}"
    for where, other_kind in other_kinds.items() if not guess(name, names) else ():
        near = guess(name, available(where))
        if near is not None and other_kind.command:
            use = f" Try: {other_kind.command} {near}" if is_asked else ""
            return f"{kind} {name!r} not found; did you mean the {other_kind.word} {near!r}?{use}"
    return f"{kind} {name!r} not found; {hint(path.stem, names, 'available')}"


def _meant(path: Path, kind: str, names: list[str]) -> str:
    """Return a hint at the file or name that was probably meant; empty without one."""
    try:
        beside = sorted(each.name for each in path.parent.iterdir() if each.suffix in _TEXTS)
    except OSError:
        folder = next(f for f in path.parents if f == Path() or _is_there(f.is_dir))
        return f": no folder {str(folder / path.relative_to(folder).parts[0])!r}"
    stems = {Path(each).stem: each for each in reversed(beside)}
    near = path.stem if path.stem in stems else guess(path.stem, stems)
    if near is not None:
        return f"; did you mean {str(path.parent / stems[near])!r}?"
    return f"; did you mean the {kind} {path.stem!r}?" if path.stem in names else ""


def refuse_to_replace(
    paths: Iterable[Path],
    overwrite: bool = False,
    remedy: str = "give another name, or --overwrite",
) -> None:
    """Refuse to overwrite the output of an earlier run or command.

    Args:
        paths: Files to be written.
        overwrite: True if the user allowed overwriting.
        remedy: Remedy to suggest to the user.

    Raises:
        ConfigError: a file exists.
    """
    existing = [path for path in paths if path.is_symlink() or path.exists()]
    if existing and not overwrite:
        more = f" and {len(existing) - 1} more" if len(existing) > 1 else ""
        raise ConfigError(f"{existing[0]}{more} would be replaced; {remedy}")


def is_file(path: Path) -> bool:
    """Return True if the file exists; False also for names that no file can have."""
    return _is_there(path.is_file)


def _is_there(look: Callable[[], bool]) -> bool:
    """Evaluate a check on disk; a name that no file can have counts as absent."""
    try:
        return look()
    except (OSError, ValueError):
        return False


def _candidates(name: str, folder: str, suffix: str, base: Path | None) -> Iterator[Path]:
    path = Path(name)
    is_path = bool(path.suffix) or path.is_absolute()
    if base is not None and is_path:
        yield base / path
    if is_path:
        yield path
    for root in roots():
        if is_path:
            yield root / path
        yield root / folder / (name if name.endswith(suffix) else name + suffix)
