"""The system that a console shows: known by its DVA's messages, wherever it runs."""
