"""Execution of a study: workers, batches, and resuming after an interruption.

It may import `study` and `results`. Begin reading at `session.py`, then `scheduling.py` (runs
handed out in chunks) and `checkpoint.py` (what is done so far).
"""
