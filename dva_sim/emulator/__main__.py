"""`python -m dva_sim.emulator`: whether the emulated link does what it is told, on this machine."""

from __future__ import annotations

import sys

from dva_sim.emulator import console
from dva_sim.errors import DvaSimError


def main() -> int:
    """Check the link; a link that cannot be is one line."""
    try:
        return console.check()
    except DvaSimError as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
