"""What processes of a run serve and tell each other: bounded files, connections and complaints.

A flood of connections to a port must not keep out anybody who shows a token, nor hold up what open
connections ask for.
"""
