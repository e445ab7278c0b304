"""Console of a remote DVA: a control room like any other, and the messages it receives.

`system` is what a console shows of it, made of what `system_state` keeps; `options` says where the
DVA is.
"""
