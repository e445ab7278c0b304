"""The audit log of a console: its rows, who writes them, and what they say of people."""
