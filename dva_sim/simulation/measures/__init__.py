"""Measures of runs: one definition each, over the commands, events and people of any model."""
