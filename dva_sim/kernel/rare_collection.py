"""Rarer collection of reference cycles in the processes of the program."""

import gc

NEW_OBJECTS = 20_000
"""Number of new objects that triggers a collection; Python's default is 700.

Modules and their classes are never freed: searching them for cycles took a twelfth of start-up.
"""


def collect_rarely() -> None:
    """Collect cycles less often in this process; not for use inside other programs."""
    gc.set_threshold(NEW_OBJECTS, 20, 20)
