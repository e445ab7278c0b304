"""Stops its process right before it does something for the n-th time, until somebody continues it.

Python imports this first, in each process that inherits `DVA_SIM_STOPS`: part of a command line, an
event of `sys.audit`, part of its arguments, the number, and the file that then names the process.
The statements in `DVA_SIM_PLANTED`, if there are any, are a fault for tests of kills themselves.
"""

import json
import os
import signal
import sys
from contextlib import suppress

program, event, word, left, mark = json.loads(os.environ["DVA_SIM_STOPS"])


def look(name: str, arguments: tuple[object, ...]) -> None:
    global left
    if name != event or not left or word not in str(arguments):
        return
    left -= 1
    if not left:
        with suppress(FileExistsError):  # another process was first
            file = os.open(mark, os.O_CREAT | os.O_EXCL | os.O_WRONLY)
            os.write(file, str(os.getpid()).encode())
            os.close(file)
            os.kill(os.getpid(), signal.SIGSTOP)


exec(os.environ.get("DVA_SIM_PLANTED", ""))
if program in " ".join(sys.orig_argv):
    sys.addaudithook(look)
