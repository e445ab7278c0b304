"""The agents: robots, operators with their phones, guards and bystanders.

They know one another and the DVA by messages only: no room here imports another of `robot`,
`operator` and `people`, and none imports the core; below them are worlds, networks and the
protocol. Begin with `device`, what every agent has, then `robot.robot` and `operator.operator`.
"""
