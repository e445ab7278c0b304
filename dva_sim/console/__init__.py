"""The console: a page in the browser, a world in real time, and the link between them."""
