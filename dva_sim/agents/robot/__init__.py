"""The robot: what it obeys, what waits for its computer, its sensors, and how it drives by itself.

It may import what all agents stand on (`device`, `observation`, `route_following`), never an
operator or the core. Begin with `controller`, the rules; `robot` binds them to body and network.
"""
