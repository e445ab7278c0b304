"""Real time: DVA, world and operators of a scenario as processes that communicate by sockets.

The package may import the full model, the network's sockets and packages below them, but not
`experiments`.
Begin reading at `supervisor`, which starts the processes, then at `process` and `parts`.
"""
