"""The network model beside real sockets: the same programs, predicted and measured.

It may import the network and what runs many jobs, but not the other kinds of evidence. Begin
reading at `reference`, then at `verdicts` and `comparison`.
"""
