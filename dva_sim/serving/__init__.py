"""Serving between the processes of a run: bounded files, connections and complaints.

A flood of connections to a port must neither keep out clients that show a token nor delay the
requests of open connections.
"""
