"""Loaded before what is heavy: garbage is looked for less often in a process that does so.

What modules define stays: to look through it for garbage takes a twelfth of loading it.
"""

import gc

gc.set_threshold(20_000, 20, 20)
