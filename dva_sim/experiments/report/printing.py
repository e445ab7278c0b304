"""The page of a report as PDF, printed by a Chromium of this machine."""

import os
import re
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from dva_sim.kernel.errors import DvaSimError

BROWSERS = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge"),
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
)
PATIENCE_S = 120  # [s]; printing takes two or three

_DATES = re.compile(rb"(?<=Date \(D:)\d{14}")
_DATE = b"20000101000000"
_NODES = re.compile(rb"(?<=\(node)\d{8}(?=\))")  # the browser's own numbers of tagged elements


def browser() -> str | None:
    """Return the path of a browser that can print without a window; None if there is none."""
    return next((path for name in BROWSERS if (path := shutil.which(name))), None)


def print_page(page: Path, to: Path) -> None:
    """Print a page; the same page gives the same bytes with the same browser.

    Args:
        page: The page, complete in one file.
        to: The PDF.

    Raises:
        DvaSimError: no browser was found, or it printed nothing.
    """
    program = browser()
    if program is None:
        raise DvaSimError(
            f"a PDF needs Chromium or Chrome, and none is installed; open {page} in any browser "
            "and print it to a PDF there"
        )
    with TemporaryDirectory() as profile:
        command = [
            program,
            "--headless",
            "--disable-gpu",
            "--disable-background-networking",
            "--no-first-run",
            "--no-pdf-header-footer",
            f"--user-data-dir={profile}",
            f"--print-to-pdf={to.resolve()}",
            page.resolve().as_uri(),
        ]
        if os.name == "posix" and os.geteuid() == 0:
            command.insert(1, "--no-sandbox")  # Chromium does not start as root otherwise
        try:
            ended = subprocess.run(command, capture_output=True, timeout=PATIENCE_S, check=False)
        except subprocess.TimeoutExpired:
            raise DvaSimError(f"{program} has not printed {page} in {PATIENCE_S} s") from None
    if ended.returncode or not to.is_file():
        problem = ended.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        raise DvaSimError(f"{program} could not print {page}: {problem or ended.returncode}")
    to.write_bytes(_undated(to.read_bytes()))


def _undated(content: bytes) -> bytes:
    """Strip dates and renumber nodes, so that two printings give the same bytes."""
    nodes = sorted(set(_NODES.findall(content)))
    numbers = {node: b"%08d" % number for number, node in enumerate(nodes, 1)}
    return _DATES.sub(_DATE, _NODES.sub(lambda match: numbers[match[0]], content))
