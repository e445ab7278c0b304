"""The words on the command line: what to run, where to write, and what a terminal shows.

It may import every room. A command takes what the function of its name in `api` takes, which is
made options of in `options`. Modules of commands import little when they are loaded, so that help
is quick. Begin reading at `program`, then at one module of commands, such as `studies`.
"""

from dva_sim.cli.program import app, call, main

__all__ = ["app", "call", "main"]
