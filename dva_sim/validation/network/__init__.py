"""The network model beside real sockets: the same programs, predicted and measured."""
