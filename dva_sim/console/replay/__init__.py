"""A recording in the console's pages: what was, at any moment of it; nothing is simulated.

It stands beside the console's world and takes its place. Begin with `player.py` for its time, with
`recorded_run.py` for the state at a moment, with `shelf.py` for the recordings of a study.
"""
