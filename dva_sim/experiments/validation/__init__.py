"""The evidence: worlds whose answer is known exactly, run again and compared."""
