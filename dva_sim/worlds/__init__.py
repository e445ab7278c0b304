"""Where a run takes place: sites, maps, paths, moving bodies and hazards."""
