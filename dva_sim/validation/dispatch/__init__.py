"""Dispatch against exact answers: worlds that theory knows, played again and compared.

It may import the timed model and the core, but not the other kinds of evidence. Begin reading at
`cases`, then at `checks`.
"""
