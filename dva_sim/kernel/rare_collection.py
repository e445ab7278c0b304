"""Rarer collection of reference cycles in the processes of the program."""

import gc

NEW_OBJECTS = 20_000
"""Objects made before Python looks for cycles among them; its own default is 700.

Modules and their classes stay: looking at them again and again took a twelfth of the start.
"""


def collect_rarely() -> None:
    """Look for cycles less often in this process; only a process of ours should call it."""
    gc.set_threshold(NEW_OBJECTS, 20, 20)
