"""The robot: its control logic, message queue, sensors, and autonomous driving.

It may import what all agents stand on (`device`, `observation`, `route_following`), never an
operator or the core. Begin with `controller`, the rules; `robot` binds them to body and network.
"""
