"""What pages are shown of whatever runs: places, hazards, robots, logs."""
