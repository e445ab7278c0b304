"""Real time: DVA, world and operators of a scenario as processes that talk by sockets."""
