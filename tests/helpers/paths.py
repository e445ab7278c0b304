"""Paths of the repository."""

import os
from pathlib import Path

TESTS = Path(__file__).parents[1]
ROOT = TESTS.parent
"""Root of the project."""

PYTHON_PATH = os.pathsep.join((str(ROOT), str(TESTS)))
"""For programs that a test starts and that import its helpers."""
