"""A console at a DVA that runs elsewhere: its options, its place there, and what only it needs."""
