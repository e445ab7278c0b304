"""The browser console: a run in real time, on a page, under a person's hands.

It may import everything below the command line. A console shows one of four: a run of its own
(`world`), one robot (`simulator`), devices of others (`remote`), or a recording
(`replay`). `supervisor.py` starts the first, `pages` the processes that serve pages (`web`) and
draw pictures. What goes between processes is declared in `wire`.
"""
