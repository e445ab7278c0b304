"""The whole table of kills, one after the other, each in a line: ok, or what was wrong.

    make kills ONLY="full disk"     those with these words in their line

Disks that are full or read-only need a mount of their own, which is seen by this program alone.
"""

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from helpers.kills.kill import MOUNTS, NAMESPACE, Kill, troubles
from helpers.kills.table import KILLS

INSIDE = "DVA_SIM_MOUNTS"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="")
    parser.add_argument("--quick", action="store_true", help="those of CI alone")
    parser.add_argument("--quiet-runs", type=Path, help="folder of runs without disturbance")
    wish = parser.parse_args()
    if INSIDE not in os.environ and mounts_are_allowed():
        os.environ[INSIDE] = "1"
        os.execvp(NAMESPACE[0], [*NAMESPACE, sys.executable, *sys.argv])
    # What a script starts with `&` ignores Ctrl-C, and so would all that is started here.
    for stop in (signal.SIGINT, signal.SIGTERM):
        signal.signal(stop, signal.default_int_handler)
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        quiet = wish.quiet_runs or Path(folder) / "quiet"
        chosen = [kill for kill in KILLS if wish.only in str(kill) and kill.is_quick >= wish.quick]
        for number, kill in enumerate(chosen):
            if why := left_out(kill.deed):
                print(f"left out  {kill}: {why}", flush=True)
                continue
            here = Path(folder) / str(number)
            here.mkdir()
            found = tried(kill, here, quiet)
            wrong += bool(found)
            lines = [f"{'WRONG' if found else 'ok':8}  {kill}", *found]
            print("\n          ".join(lines), flush=True)
            shutil.rmtree(here, ignore_errors=True)
    print(f"{len(chosen)} kills, {wrong} wrong")
    return int(wrong > 0 or not chosen)


def tried(kill: Kill, folder: Path, quiet: Path) -> list[str]:
    try:
        return troubles(kill, folder, quiet)
    except Exception as error:
        return [f"{type(error).__name__}: {error}"]


def mounts_are_allowed() -> bool:
    if shutil.which(NAMESPACE[0]) is None:
        return False
    with tempfile.TemporaryDirectory() as folder:
        words = [*NAMESPACE, "mount", "-t", "tmpfs", "tmpfs", folder]
        return subprocess.run(words, capture_output=True, check=False).returncode == 0


def left_out(deed: str) -> str:
    """Return why a deed is not possible on this machine; empty if it is."""
    if deed in MOUNTS and INSIDE not in os.environ:
        return "this system lets nobody but root mount a disk"
    if deed.startswith("clock") and shutil.which("cc") is None:
        return "no C compiler"
    return ""


if __name__ == "__main__":
    sys.exit(main())
