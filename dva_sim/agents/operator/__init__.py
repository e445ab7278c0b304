"""Operators: persons with a phone, who see delayed frames and tilt, or watch a mission.

They may import the phone (`tilt`) and what all agents stand on, never a robot or the core: what
they know of a robot is in frames and messages. Begin with `operator`, then `drive` and
`supervision`; how they steer is in `strategies`.
"""
