"""The viewer: a web server, the page's state, and the command line."""
