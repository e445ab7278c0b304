"""The words on the command line: what to run, where to write, and what a terminal shows.

It may import every room but `api`, which does the same for programs; modules of commands import
little when they are loaded, so that help is quick. Begin reading at `program`, then at one module
of commands, such as `studies`.
"""

from dva_sim.cli.program import app, call, main

__all__ = ["app", "call", "main"]
