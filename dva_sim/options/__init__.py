"""Options of commands: each command's in one frozen dataclass, with its words, bounds and default.

It may import the kernel alone, since every command begins here. `forms` says how an option is
described, `runs` and `studies` hold the options of commands. The command line is made of them in
`cli/commands.py`, and functions of `dva_sim` take them as keywords.
"""
