"""The kills that are tried with each change, by what is killed."""

import sys
from pathlib import Path

import pytest
from helpers.paths import TESTS
from helpers.processes import patience


def try_kills(subject: str, quiet: Path) -> None:
    """Try those of a subject in a program of its own, which alone sees what it mounts."""
    words = [sys.executable, TESTS / "kill_all.py", "--quick", "--only", f"{subject}: "]
    ran = patience.run([*words, "--quiet-runs", quiet], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    if left_out := [line for line in ran.stdout.splitlines() if line.startswith("left out")]:
        pytest.skip("; ".join(left_out))
