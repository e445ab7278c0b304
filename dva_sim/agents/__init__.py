"""The agents: robots, guards, operators with their phones. They know the DVA by messages only."""
