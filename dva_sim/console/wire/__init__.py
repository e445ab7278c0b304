"""Actions that clients may request: each declared once, with its arguments and its role.

`actions` lists what a client may ask for, `kinds` what an argument may be, and `roles` who may ask.
Everything of the console may import this package, and it imports nothing of the console.
"""
