"""A console's own run, and the parts of it that are published and recorded."""
