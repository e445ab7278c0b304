"""Pictures of simulated robots' cameras: drawn beside the run, and streamed to any player.

The run's process notes which frames were taken (`screens`); another process draws those that
somebody watches (`painting`, `drawing`), and they are served by HTTP (`streams`, `streaming`). No
process waits for another one (`pipes`).
"""
