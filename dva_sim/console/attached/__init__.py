"""A console at a DVA that runs elsewhere: a control room like anybody's, and what it is told.

`system` is what a console shows of it, made of what `told` keeps; `options` says where the DVA is.
"""
