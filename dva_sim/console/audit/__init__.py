"""The audit log of a console: its rows, their authors, and measures of what people did."""
