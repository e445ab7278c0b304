"""Serving between the processes of a run: bounded files, connections and complaints.

A flood of connections to a port must not keep out anybody who shows a token, nor hold up what open
connections ask for.
"""
