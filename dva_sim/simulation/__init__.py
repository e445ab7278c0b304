"""The models of a run, side by side: full, shift, task and transport."""
