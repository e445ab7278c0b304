"""A console's own run, and what of it is told and kept."""
