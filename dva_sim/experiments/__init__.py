"""Studies: what is varied, how it is run, and what can be concluded from it."""
