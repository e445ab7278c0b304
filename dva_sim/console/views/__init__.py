"""Views of whatever runs, for pages: positions, hazards, robots, logs."""
