"""The pages: their processes, addresses, options and colours."""
