"""Builds the wheel, installs it in an empty environment, and tries it in an empty folder.

python tests/release_check.py        exit 1 at the first thing that is not as a release should be
"""

import os
import re
import subprocess
import sys
import tempfile
import tomllib
import venv
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TRIED = (
    ("list",),
    ("episode", "drive-to-event"),
    ("episode", "patrol-shift", "--set", "horizon_s=900"),
    ("new", "first"),
    ("check", "first.yaml"),
    ("run", "first.yaml", "--set", "persons=2", "--set", "replications=1", "-q", "-o", "first"),
    ("show", "first"),
    ("check", "policy", "patrol.py:Patrol"),
    ("live", "drive-to-event", "--for", "3"),
)


def version_faults(root: Path) -> list[str]:
    """Return what does not agree with the version of the project."""
    read = lambda name: (root / name).read_text(encoding="utf-8")  # noqa: E731
    version = tomllib.loads(read("pyproject.toml"))["project"]["version"]
    faults = []
    if f'\n__version__ = "{version}"\n' not in read("dva_sim/__init__.py"):
        faults.append(f"dva_sim/__init__.py has another version than {version}")
    if f"\nversion: {version}\n" not in read("CITATION.cff"):
        faults.append(f"CITATION.cff has another version than {version}")
    if not re.search(
        rf"^## \[{re.escape(version)}\] - \d{{4}}-\d\d-\d\d$", read("CHANGELOG.md"), re.M
    ):
        faults.append(f"CHANGELOG.md has no dated section [{version}]")
    return faults


def main() -> int:
    """Check the versions, then the wheel; return the exit code."""
    for fault in (faults := version_faults(ROOT)):
        print(f"error: {fault}", file=sys.stderr)
    if faults:
        return 1
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        print("Building the wheel ...", flush=True)
        run(
            [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", made, str(ROOT)], folder
        )
        (wheel,) = folder.glob("dva_sim-*.whl")
        print(f"Installing {wheel.name} ({wheel.stat().st_size / 1e6:.1f} MB) ...", flush=True)
        venv.create(folder / "env", with_pip=True)
        binaries = folder / "env/bin"
        constraints = str(ROOT / "constraints.txt")
        run([str(binaries / "pip"), "install", "-q", "-c", constraints, str(wheel)], folder)
        (folder / "empty").mkdir()
        for words in TRIED:
            print("dva-sim", *words, flush=True)
            run([str(binaries / "dva-sim"), *words], folder / "empty")
    print("The wheel works.")
    return 0


def run(command: Sequence[str], folder: Path) -> None:
    """Run a command in a folder, outside any environment; end the program if it fails."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    kept["PIP_DISABLE_PIP_VERSION_CHECK"] = "1"
    done = subprocess.run(
        command, cwd=folder, env=kept, capture_output=True, text=True, check=False
    )
    if done.returncode:
        print(done.stdout, done.stderr, sep="\n", file=sys.stderr)
        sys.exit(f"error: exit code {done.returncode}: {' '.join(command)}")


if __name__ == "__main__":
    sys.exit(main())
