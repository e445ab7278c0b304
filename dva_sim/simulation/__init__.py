"""The models of a run, side by side: from a scenario and a seed to rows.

Each has a folder of its own (`full`, `task`, `timed`, `transports`); `models` shows all behind one
interface, `labels` says how things are called. A module here may import agents, core, worlds and
network, and nothing that compares runs. Begin with `models.Model`.
"""
