"""What a console needs of a run in real time: its memory, its links and its lag."""
