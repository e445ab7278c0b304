"""The words on the command line: what to run, where to write, what to show. No logic."""

from dva_sim.cli.program import app, call, main

__all__ = ["app", "call", "main"]
