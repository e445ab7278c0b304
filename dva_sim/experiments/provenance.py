"""Which state of the program made some results: commit, and whether anything was changed since."""

from __future__ import annotations

import os
import subprocess
from functools import cache
from pathlib import Path

import dva_sim

# Beside the program: what a run reads by name. Studies and scenarios stand in the manifest whole.
_EDITED = ("agents", "protocol", "worlds")


@cache
def program_state() -> dict[str, str | bool | None]:
    """Of the program that is running, as it was when first asked for; see `state_of`."""
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
    """What git says, or None if it cannot."""
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
