"""Pictures of simulated robots' cameras, drawn outside of the run's process and streamed by HTTP.

The run's process notes which frames were taken (`screens`); another process draws those that have
viewers (`painting`, `drawing`) and serves them (`streams`, `streaming`). No process waits for
another.
"""
