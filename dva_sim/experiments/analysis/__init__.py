"""What the runs of a study show: effects, tests, robustness, and the answer in sentences."""
