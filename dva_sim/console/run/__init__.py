"""Parts of a run in real time that a console needs: its recorder, its links and its lag."""
