"""Real time: DVA, world and operators of a scenario as processes that talk by sockets.

It may import the full model, the network's sockets and what lies below them, but no experiments.
Begin reading at `supervisor`, which starts the processes, then at `process` and `parts`.
"""
