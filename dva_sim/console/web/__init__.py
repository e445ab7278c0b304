"""The web process: it knows the newest state of a run, and serves pages, sockets and pictures.

It gets lines from the simulation by one pipe and pictures by another, and never makes either wait.
Begin with `app.py`; who may do what is decided in `access.py`, what a slow page gets in `feed.py`.
"""
