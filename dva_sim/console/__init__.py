"""The browser console: a run in real time, on a page, under a person's hands.

It may import everything below the command line. Begin with `world.py` for what runs, with
`processes.py` for the processes beside it, `web/__init__.py` for what a browser meets, and
`pictures.py` for what a robot's camera shows.
"""
