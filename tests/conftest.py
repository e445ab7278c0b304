"""Settings for all tests: the summary at the end of a run, and the length of random searches."""

import gc
import signal

from helpers.processes.search_settings import search
from hypothesis import settings

pytest_plugins = [
    "helpers.console.one_browser",
    "helpers.processes.programs",
    "helpers.reporting.cpu_by_room",
    "helpers.reporting.left_out",
]

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # As for a command that a script starts with `&`: then nothing that is started here would hear
    # a Ctrl-C either, and tests of it would wait for ever.
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("search", search())
settings.load_profile("search")


def pytest_collection_finish():
    """Spare the garbage collector what lives until the end: looking through it took a tenth."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 50)
