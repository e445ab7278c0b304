"""Running a program twice: in this process, and in one with another hash seed."""

import io
import sys
from contextlib import redirect_stdout

from helpers.paths import ROOT, TESTS
from helpers.processes import patience

PATHS = [str(TESTS), str(ROOT)]


def run_here_and_elsewhere(program: str) -> tuple[str, str]:
    """Outputs of a program in both processes; it can import the test helpers."""
    here = io.StringIO()
    with redirect_stdout(here):
        exec(program, {"__name__": "__main__"})
    elsewhere = patience.run(
        [sys.executable, "-c", f"import sys\nsys.path[:0] = {PATHS!r}\n{program}"],
        capture_output=True,
        check=True,
        text=True,
        env={"PYTHONHASHSEED": "1", "PATH": ""},
    )
    return here.getvalue(), elsewhere.stdout
