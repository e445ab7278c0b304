"""HTTP servers inside the processes of a run: few files, bounded connections, bounded complaints.

A flood of connections to a port must not keep out anybody who shows a token, nor hold up what open
connections ask for.
"""
