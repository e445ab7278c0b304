"""What goes between pages, the web process and what a console shows: one declaration for each.

`actions` lists what a client may ask for, `kinds` what an argument may be, and `roles` who may ask.
Everything of the console may import this package, and it imports nothing of the console.
"""
