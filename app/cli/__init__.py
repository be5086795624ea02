"""The commands of the command line, one module each: its arguments, its action and what it prints.

Imports all rooms of the tracker, and the app's `runtime`, `session`, `server` and `bench`. `app.main` registers
each module's `command`. The modules import other rooms inside functions, so that `--help` starts without them.
"""
