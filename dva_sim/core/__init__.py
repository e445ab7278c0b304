"""The DVA core: who is there, what happens, who goes. It knows no clock, no sockets and no map.

It takes messages and the time, and returns what to answer and what to send.
"""
