"""The DVA core: who is there, what happens, who goes.

It takes messages and the time, and returns what to answer and what to send; it knows no clock, no
sockets and no map, agents only by their messages, and imports only the protocol and the kernel.
Begin with `dva`, then `dispatcher` and `dispatch`, the policies; only `store` knows files.
"""
