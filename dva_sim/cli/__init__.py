"""The command line: its commands and options, and the output on a terminal.

It may import every room. A command takes the arguments of the function of its name in `api`, which
`options` turns into options. Modules of commands import little when they are loaded, so that help
is quick. Begin reading at `program`, then at one module of commands, such as `studies`.
"""

from dva_sim.cli.program import app, call, main

__all__ = ["app", "call", "main"]
