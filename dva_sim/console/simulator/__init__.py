"""One simulated robot as a program of its own."""
