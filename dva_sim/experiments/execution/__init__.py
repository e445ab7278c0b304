"""Running a study: jobs, executors, the checkpoint, and what it leaves on disk."""
